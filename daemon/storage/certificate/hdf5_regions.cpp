#include "daemon/storage/certificate/hdf5_regions.hpp"

#include <algorithm>
#include <array>

#include "daemon/storage/dataset/hdf5_handle.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {
namespace {

/// A column of samples: how many rows each trial has in it.
struct SampleColumn {
  const char* path;
  std::size_t (*rows)(const classifier::Trial&, const TrialRecord&);
};

std::size_t taxel_rows(const classifier::Trial& trial, const TrialRecord&) {
  return trial.samples();
}
std::size_t clock_rows(const classifier::Trial&, const TrialRecord& record) {
  return record.device_us.size();
}
std::size_t wrench_rows(const classifier::Trial&, const TrialRecord& record) {
  return record.wrench.samples();
}
std::size_t stage_rows(const classifier::Trial&, const TrialRecord& record) {
  return record.stages.samples();
}

constexpr std::array sample_columns{
    SampleColumn{"/taxel/counts", taxel_rows}, SampleColumn{"/taxel/phase", taxel_rows},
    SampleColumn{"/taxel/t_ns", taxel_rows},   SampleColumn{"/taxel/device_us", clock_rows},
    SampleColumn{"/wrench/t_ns", wrench_rows}, SampleColumn{"/wrench/quanta", wrench_rows},
    SampleColumn{"/stages/t_ns", stage_rows},  SampleColumn{"/stages/quanta", stage_rows}};

/// "trial 0007-..." or "trials 0007-... to 0009-..." of rows [first, last).
std::string trials_of_rows(const Dataset& dataset, const SampleColumn& column, std::size_t first,
                           std::size_t last) {
  std::size_t row = 0;
  std::string from, to;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const std::size_t next = row + column.rows(dataset.trials[i], dataset.records[i]);
    if (row < last && first < next) {
      to = dataset.trials[i].file;
      if (from.empty()) from = to;
    }
    row = next;
  }
  if (from == to) return "trial " + from;
  return "trials " + from + " to " + to;
}

struct Collected {
  const Dataset* dataset;
  std::vector<FileRegion> regions;
};

void add_chunks(hid_t column, const std::string& path, Collected& out) {
  const auto* known = std::find_if(sample_columns.begin(), sample_columns.end(),
                                   [&](const SampleColumn& c) { return path == c.path; });
  const hdf5::Handle properties(H5Dget_create_plist(column), H5Pclose);
  const hdf5::Handle space(H5Dget_space(column), H5Sclose);
  std::array<hsize_t, 2> chunk{0, 0}, size{0, 0};
  H5Pget_chunk(properties.id(), 2, chunk.data());
  H5Sget_simple_extent_dims(space.id(), size.data(), nullptr);
  hsize_t chunks = 0;
  if (H5Dget_num_chunks(column, space.id(), &chunks) < 0) return;
  for (hsize_t i = 0; i < chunks; ++i) {
    std::array<hsize_t, 2> at{0, 0};
    unsigned filters = 0;
    haddr_t address = 0;
    hsize_t bytes = 0;
    if (H5Dget_chunk_info(column, space.id(), i, at.data(), &filters, &address, &bytes) < 0) return;
    std::string holds = path;
    if (known != sample_columns.end())
      holds +=
          " of " + trials_of_rows(*out.dataset, *known, at[0], std::min(size[0], at[0] + chunk[0]));
    out.regions.push_back({address, bytes, std::move(holds)});
  }
}

herr_t visit(hid_t file, const char* name, const H5O_info_t* info, void* collected) {
  if (info->type != H5O_TYPE_DATASET) return 0;
  auto& out = *static_cast<Collected*>(collected);
  const std::string path = std::string("/") + name;
  const hdf5::Handle column(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  const hdf5::Handle properties(H5Dget_create_plist(column.id()), H5Pclose);
  if (H5Pget_layout(properties.id()) == H5D_CHUNKED) {
    add_chunks(column.id(), path, out);
  } else if (const haddr_t address = H5Dget_offset(column.id()); address != HADDR_UNDEF) {
    out.regions.push_back({address, H5Dget_storage_size(column.id()), path});
  }
  return 0;
}

}  // namespace

std::vector<FileRegion> regions_of_campaign(const std::filesystem::path& campaign) {
  std::vector<FileRegion> out;
  auto database = sqlite::Database::open(campaign, sqlite::Mode::read_only);
  if (!database) return out;
  auto query = database->prepare("SELECT name, pageno, pgsize FROM dbstat ORDER BY pageno");
  if (!query) return out;
  while (true) {
    const auto row = query->step();
    if (!row || !*row) return out;
    const auto bytes = static_cast<std::uint64_t>(query->integer(2));
    const std::uint64_t first = (static_cast<std::uint64_t>(query->integer(1)) - 1) * bytes;
    const std::string holds = "table " + query->text(0);
    if (!out.empty() && out.back().holds == holds && out.back().first + out.back().bytes == first)
      out.back().bytes += bytes;
    else
      out.push_back({first, bytes, holds});
  }
}

std::vector<FileRegion> regions_of_dataset(const std::filesystem::path& file,
                                           const Dataset& dataset) {
  const hdf5::QuietErrors quiet;
  Collected collected{&dataset, {}};
  const hdf5::Handle opened(H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!opened.ok()) return {};
  H5Ovisit2(opened.id(), H5_INDEX_NAME, H5_ITER_NATIVE, visit, &collected, H5O_INFO_BASIC);
  std::sort(collected.regions.begin(), collected.regions.end(),
            [](const FileRegion& a, const FileRegion& b) { return a.first < b.first; });
  return std::move(collected.regions);
}

}  // namespace weft::daemon
