#pragma once
// The certificate of a campaign and its data set: what was recorded with which devices, and digests
// that detect a flipped bit anywhere in the two files. Layout: docs/reference/dataset.md,
// "Certificate".

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/promise.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {

inline constexpr const char* certificate_file_name = "certificate.json";
inline constexpr const char* dataset_file_name = "dataset.h5";
/// Largest certificate or handover evaluation that is read [bytes]. Enough for 150 000 attempts,
/// about a year on one rig.
inline constexpr std::uintmax_t most_list_bytes = std::uintmax_t{1} << 26;

/// Samples of a stream that never arrived.
struct CertifiedGap {
  std::string stream;
  std::uint32_t before_sequence = 0;  ///< sequence number of the first sample after the gap
  std::uint32_t lost = 0;
  bool operator==(const CertifiedGap&) const = default;
};

/// One attempt at a trial, whatever its outcome.
struct CertifiedTrial {
  std::string name;  ///< as in the data set: "0007-denim-M1-r03-a1"
  std::string outcome;
  std::string sha256;            ///< digest of the content (docs/reference/dataset.md, "Digest")
  std::string catalogue_sha256;  ///< digest of the trial's row and its chunks' rows, without
                                 ///< samples
  std::vector<CertifiedGap> gaps;
  bool operator==(const CertifiedTrial&) const = default;
};

/// SHA-256 over all rows of a table.
struct CertifiedTable {
  std::string name;
  std::string sha256;
  bool operator==(const CertifiedTable&) const = default;
};

/// A file and the SHA-256 of its bytes.
struct FileChecksums {
  std::string name;  ///< without folder
  std::uint64_t bytes = 0;
  std::string sha256;
  bool operator==(const FileChecksums&) const = default;
};
/// Errors: not_found, io; wrong_state when it was stopped.
Result<FileChecksums> file_checksums(const std::filesystem::path& file,
                                     const StopRequested& stop_requested = {});

/// Largest deviation of the resting force from the probe's weight, over the complete trials [N].
struct CertifiedRest {
  double weight_n = 0;
  std::uint64_t trials = 0;                      ///< trials with a measured rest, in S and in E
  double worst_before_n = 0, worst_after_n = 0;  ///< force furthest from the weight, in S and in E
  std::string worst_trial;                       ///< name of the trial with the largest deviation
  bool operator==(const CertifiedRest&) const = default;
};

struct Certificate {
  std::string bench_kind, name, seed, software_version;
  std::string recipe_sha256, rig_sha256;  ///< the rig file holds the calibrations
  std::vector<DeviceInfo> devices;        ///< serial, firmware, scale factors
  std::uint64_t trials_planned = 0;
  std::optional<CertifiedRest> rest;              ///< none: not measured
  std::optional<CertifiedSimulation> simulation;  ///< none: neither accuracy nor speed was
                                                  ///< requested
  std::vector<EndedEarly> ended_early;            ///< left out of the data set, see DatasetInfo
  std::string dataset_sha256;  ///< digest of the complete trials; empty if there are none
  std::vector<CertifiedTrial> trials;
  std::vector<CertifiedTable> tables;
  std::vector<FileChecksums> files;  ///< the campaign file, and the data set if there is one
  bool operator==(const Certificate&) const = default;
};

std::string to_json(const Certificate& certificate);
/// Errors: parse; corrupt if the certificate's own digest disagrees.
Result<Certificate> certificate_from_json(const std::string& text);

/// Digests of the rows that no CRC covers: the tables that hold no trial data.
Result<std::vector<CertifiedTable>> table_digests(sqlite::Database& campaign);

/// One attempt as the file has it, without its samples.
struct CataloguedTrial {
  std::int64_t id = 0;  ///< id of its row
  std::string sha256;   ///< digest of its row and its chunks' rows
  std::vector<CertifiedGap> gaps;
};
/// In plan order, as load_campaign() gives them.
Result<std::vector<CataloguedTrial>> catalogued_trials(sqlite::Database& campaign);

/// The campaign must be finished. `dataset`: its HDF5 file, or empty. Errors: load_campaign()'s,
/// io.
Result<Certificate> certify(const std::filesystem::path& campaign,
                            const std::filesystem::path& dataset);
/// Writes certify()'s result beside the campaign file.
Status write_certificate(const std::filesystem::path& campaign,
                         const std::filesystem::path& dataset);
/// Writes the data set of a finished campaign, and a certificate of both files. The campaign is
/// read once and each trial is hashed once; another thread hashes the campaign file. Returns the
/// data set's digest. Errors: load_campaign()'s, write_hdf5()'s. If the campaign cannot be
/// certified, the data set is still written before the error is returned.
Result<std::string> export_certified(const std::filesystem::path& campaign,
                                     const std::filesystem::path& dataset);
/// Nothing if the folder has no certificate.
Result<std::optional<Certificate>> read_certificate(const std::filesystem::path& folder);

}  // namespace weft::daemon
