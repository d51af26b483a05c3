#include "daemon/storage/certificate/file_checksums.hpp"

#include <algorithm>
#include <set>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/raw_file.hpp"
#include "protocols/base/crc.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t most_names = 6;

std::string names_in(const std::vector<FileRegion>& regions, std::uint64_t first,
                     std::uint64_t bytes) {
  std::set<std::string> names;
  for (const FileRegion& region : regions)
    if (region.first < first + bytes && first < region.first + region.bytes)
      names.insert(region.holds);
  std::string text;
  for (const std::string& name : names) {
    if (!text.empty()) text += ", ";
    text += name;
    if (text.size() > most_names * 40) return text + ", ...";
  }
  return text.empty() ? "the file's own structure" : text;
}

}  // namespace

Result<FileChecksums> file_checksums(const std::filesystem::path& file,
                                     std::vector<FileRegion> regions,
                                     const StopRequested& stop_requested) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return fail({.code = Errc::not_found, .where = file.string(), .what = "no such file"});
  FileChecksums checksums;
  checksums.name = file.filename().string();
  checksums.regions = std::move(regions);
  const auto in = sqlite::RawFile::open(file);  // this process may be writing it
  if (!in) return pass(in.error());
  Bytes block(FileChecksums::block_bytes);
  Sha256 hash;
  while (true) {
    const auto got = in->read(checksums.bytes, block);
    if (!got) return pass(got.error(), file.string());
    if (*got == 0) break;
    if (stop_requested && stop_requested()) return pass(stopped_early(file.string()));
    const ByteView seen = ByteView(block).first(*got);
    hash.update(seen);
    checksums.block_crc32.push_back(crc32(seen));
    checksums.bytes += *got;
  }
  checksums.sha256 = to_hex(hash.finish());
  return checksums;
}

std::vector<AlteredBytes> altered(const FileChecksums& then, const FileChecksums& now) {
  constexpr std::uint64_t size = FileChecksums::block_bytes;
  std::vector<AlteredBytes> out;
  const std::size_t blocks = std::max(then.block_crc32.size(), now.block_crc32.size());
  for (std::size_t i = 0; i < blocks; ++i) {
    const bool in_both = i < then.block_crc32.size() && i < now.block_crc32.size();
    if (in_both && then.block_crc32[i] == now.block_crc32[i]) continue;
    const std::uint64_t first = i * size;
    if (!out.empty() && out.back().first + out.back().bytes == first)
      out.back().bytes += size;
    else
      out.push_back({first, size, {}});
  }
  // A change that all CRCs miss.
  if (out.empty() && (then.sha256 != now.sha256 || then.bytes != now.bytes))
    out.push_back({0, std::max(then.bytes, now.bytes), {}});
  for (AlteredBytes& run : out) {
    run.bytes = std::min(run.bytes, std::max(then.bytes, now.bytes) - run.first);
    run.holds = names_in(then.regions, run.first, run.bytes);
  }
  return out;
}

}  // namespace weft::daemon
