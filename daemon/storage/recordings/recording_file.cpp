// HDF5, layout "weft-recordings".
#include <new>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon {
namespace {

using classifier::vibro::Channel;
using classifier::vibro::Gap;
using classifier::vibro::Recording;

constexpr const char* format_name = "weft-recordings";
constexpr std::uint32_t recordings_version = 1;
constexpr std::size_t max_channels = 64;

std::string column_of(std::size_t channel, const char* what) {
  return "/channels/" + std::to_string(channel) + "_" + what;
}

void write_table(hdf5::Writer& out, const RecordingSet& set) {
  const std::vector<Channel>& channels = set.recordings.front().channels;
  out.group("/recordings");
  out.column("/recordings/file", hdf5::gather(set.recordings, &Recording::file));
  out.column("/recordings/label", hdf5::gather(set.recordings, &Recording::label));
  out.column("/recordings/group", hdf5::gather(set.recordings, &Recording::group));
  out.group("/channels");
  out.column("/channels/name", hdf5::gather(channels, &Channel::name));
  out.column("/channels/unit", hdf5::gather(channels, &Channel::unit));
  out.column("/channels/rate_hz", hdf5::gather(channels, &Channel::rate_hz));
}

void write_samples(hdf5::Writer& out, const RecordingSet& set, std::size_t channel) {
  const auto samples = [&](const Recording& r) -> auto& {
    return r.samples[channel];
  };
  const auto count = [&](const Recording& r) { return std::uint64_t{samples(r).size()}; };
  out.column(column_of(channel, "count"), hdf5::gather(set.recordings, count));
  out.column(column_of(channel, "samples"), hdf5::concatenate(set.recordings, samples));
}

/// A set without gaps has no HDF5 group for them.
void write_gaps(hdf5::Writer& out, const RecordingSet& set) {
  std::vector<std::uint64_t> recording;
  std::vector<Gap> gaps;
  for (std::size_t r = 0; r < set.recordings.size(); ++r)
    for (const Gap& gap : set.recordings[r].gaps) {
      recording.push_back(r);
      gaps.push_back(gap);
    }
  if (gaps.empty()) return;
  out.group("/gaps");
  out.column("/gaps/recording", recording);
  out.column("/gaps/from_s", hdf5::gather(gaps, &Gap::from_s));
  out.column("/gaps/to_s", hdf5::gather(gaps, &Gap::to_s));
}

Status read_gaps(hdf5::Reader& in, RecordingSet& set) {
  if (!in.has("/gaps")) return {};
  const auto recording = in.column<std::uint64_t>("/gaps/recording");
  const auto from_s = in.column<double>("/gaps/from_s"), to_s = in.column<double>("/gaps/to_s");
  in.require(from_s.size() == recording.size() && to_s.size() == recording.size(), "/gaps",
             "columns differ in length");
  if (!in.status()) return in.status();
  for (std::size_t g = 0; g < recording.size(); ++g)
    if (in.require(recording[g] < set.recordings.size(), "/gaps/recording", "unknown recording"))
      set.recordings[recording[g]].gaps.push_back({from_s[g], to_s[g]});
  return in.status();
}

Status read_columns_of_groups(hdf5::Reader& in, RecordingSet& set) {
  StoredGroupColumns stored = read_group_columns(in, set.recordings.size());
  set.group_columns = std::move(stored.names);
  for (std::size_t r = 0; r < stored.of_row.size(); ++r)
    set.recordings[r].group_values = std::move(stored.of_row[r]);
  return in.status();
}

Status read_root(hdf5::Reader& in, RecordingSet& set, std::string& digest) {
  const std::string format = in.text_attribute("/", "format");
  if (!in.status() || format != format_name)
    return fail({.code = Errc::parse,
                 .what = "not Weft recordings, but another HDF5 file",
                 .expected = format_name,
                 .got = format});
  const std::uint64_t version = in.integer_attribute("/", "format_version");
  if (in.status() && version != recordings_version)
    return fail({.code = Errc::unsupported,
                 .what = "unsupported version of recordings",
                 .expected = std::to_string(recordings_version),
                 .got = std::to_string(version)});
  const auto kind = bench_kind_from(in.text_attribute("/", "bench_kind"));
  in.require(kind.has_value(), "bench_kind", "unknown bench kind");
  set.kind = kind.value_or(BenchKind::unknown);
  set.name = in.text_attribute("/", "name");
  set.source = in.text_attribute("/", "source");
  digest = in.text_attribute("/", "sha256");
  return in.status();
}

Status read_table(hdf5::Reader& in, RecordingSet& set) {
  const auto file = in.texts("/recordings/file"), label = in.texts("/recordings/label"),
             group = in.texts("/recordings/group"), name = in.texts("/channels/name"),
             unit = in.texts("/channels/unit");
  const auto rate_hz = in.column<double>("/channels/rate_hz");
  in.require(label.size() == file.size() && group.size() == file.size(), "/recordings",
             "columns differ in length");
  in.require(
      unit.size() == name.size() && rate_hz.size() == name.size() && name.size() <= max_channels,
      "/channels", "columns differ in length, or too many channels");
  if (!in.status()) return in.status();
  std::vector<Channel> channels;
  for (std::size_t c = 0; c < name.size(); ++c) channels.push_back({name[c], rate_hz[c], unit[c]});
  for (std::size_t r = 0; r < file.size(); ++r)
    set.recordings.push_back({file[r], label[r], group[r], channels, {}});
  return {};
}

Status read_samples(hdf5::Reader& in, RecordingSet& set, std::size_t channel) {
  const std::string where = column_of(channel, "samples");
  const auto count = in.column<std::uint64_t>(column_of(channel, "count"));
  const auto all = in.column<double>(where);
  in.require(count.size() == set.recordings.size(), where, "wrong number of recordings");
  if (!in.status()) return in.status();
  std::size_t first = 0;
  for (std::size_t r = 0; r < count.size(); ++r) {
    if (!in.require(count[r] <= all.size() - first, where, "fewer samples than counted"))
      return in.status();
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
    set.recordings[r].samples.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(count[r]));
    first += count[r];
  }
  in.require(first == all.size(), where, "more samples than counted");
  return in.status();
}

Result<RecordingSet> read_checked(hdf5::Reader& in) {
  RecordingSet set;
  std::string digest;
  if (auto done = read_root(in, set, digest); !done) return pass(done.error());
  if (auto done = read_table(in, set); !done) return pass(done.error());
  if (auto done = read_gaps(in, set); !done) return pass(done.error());
  if (auto done = read_columns_of_groups(in, set); !done) return pass(done.error());
  const std::size_t channels = set.recordings.empty() ? 0 : set.recordings.front().channels.size();
  for (std::size_t c = 0; c < channels; ++c)
    if (auto done = read_samples(in, set, c); !done) return pass(done.error());
  if (auto fine = check(set); !fine) {
    fine.error().code = Errc::corrupt;
    return pass(fine.error());
  }
  if (recordings_sha256(set) != digest)
    return fail({.code = Errc::corrupt,
                 .what = "recordings altered, SHA-256 differs",
                 .expected = digest,
                 .got = recordings_sha256(set)});
  return set;
}

}  // namespace

Result<std::string> write_recordings(const RecordingSet& set, const std::filesystem::path& path) {
  if (auto fine = check(set); !fine) return pass(fine.error(), path.string());
  const hdf5::QuietErrors quiet;
  std::string digest = recordings_sha256(set);
  AtomicFile atomic(path);
  hdf5::Writer out = hdf5::Writer::create(atomic.temporary());
  out.attribute("/", "format", format_name);
  out.attribute("/", "format_version", recordings_version);
  out.attribute("/", "bench_kind", to_string(set.kind));
  out.attribute("/", "name", set.name);
  out.attribute("/", "source", set.source);
  out.attribute("/", "software_version", software_version());
  out.attribute("/", "sha256", digest);
  write_table(out, set);
  write_gaps(out, set);
  write_group_columns(out, set.group_columns,
                      hdf5::concatenate(set.recordings, &Recording::group_values));
  for (std::size_t c = 0; c < set.recordings.front().channels.size(); ++c)
    write_samples(out, set, c);
  if (auto done = out.close(); !done) return pass(done.error(), path.string());
  if (auto done = atomic.publish(); !done) return pass(done.error());
  return digest;
}

Result<RecordingSet> read_recordings(const std::filesystem::path& path) {
  const hdf5::QuietErrors quiet;
  auto in = hdf5::Reader::open(path);
  if (!in) return pass(in.error());
  try {
    auto set = read_checked(*in);
    if (!set) return pass(set.error(), path.string());
    return set;
  } catch (const std::bad_alloc&) {
    return fail({.code = Errc::corrupt,
                 .where = path.string(),
                 .what = "file declares more samples than fit into memory"});
  }
}

bool is_recordings_file(const std::filesystem::path& path) {
  const hdf5::QuietErrors quiet;
  auto in = hdf5::Reader::open(path);
  return in && in->text_attribute("/", "format") == format_name;
}

}  // namespace weft::daemon
