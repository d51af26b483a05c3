#pragma once
// What a file looked like, block by block, so that a flipped bit is found and said where it lies.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "daemon/base/file/stop_requested.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Bytes of a file that belong to something with a name: a table, a column's rows.
struct FileRegion {
  std::uint64_t first = 0;  ///< byte
  std::uint64_t bytes = 0;
  std::string holds;
  bool operator==(const FileRegion&) const = default;
};

struct FileChecksums {
  /// A page of the campaign file, and cheap enough to list: 8 characters for each.
  static constexpr std::size_t block_bytes = 16384;

  std::string name;  ///< without folder
  std::uint64_t bytes = 0;
  std::string sha256;
  std::vector<std::uint32_t> block_crc32;  ///< the last block may be short
  std::vector<FileRegion> regions;         ///< in order, not overlapping
  bool operator==(const FileChecksums&) const = default;
};

/// Errors: not_found, io; wrong_state when it was stopped.
Result<FileChecksums> file_checksums(const std::filesystem::path& file,
                                     std::vector<FileRegion> regions = {},
                                     const StopRequested& stop_requested = {});

/// A run of blocks that differ.
struct AlteredBytes {
  std::uint64_t first = 0;  ///< byte
  std::uint64_t bytes = 0;
  std::string holds;  ///< names of the regions that it touches
};
/// Where `now` differs from `then`; empty exactly when both are the same bytes.
std::vector<AlteredBytes> altered(const FileChecksums& then, const FileChecksums& now);

}  // namespace weft::daemon
