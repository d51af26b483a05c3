#include "daemon/storage/recordings/recording_set.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "daemon/base/file/sha256.hpp"

namespace weft::daemon {
namespace {

using classifier::vibro::Channel;
using classifier::vibro::Recording;

Status check_channels(const std::vector<Channel>& channels) {
  std::set<std::string> names;
  for (const Channel& c : channels) {
    if (c.name.empty() || !names.insert(c.name).second)
      return fail({.code = Errc::invalid_argument,
                   .where = c.name,
                   .what = "a channel's name must be present and unique"});
    if (!(c.rate_hz > 0.0) || !std::isfinite(c.rate_hz))
      return fail({.code = Errc::invalid_argument,
                   .where = c.name,
                   .what = "a channel needs a sampling rate",
                   .expected = "a positive number of Hz",
                   .got = std::to_string(c.rate_hz)});
  }
  if (channels.empty())
    return fail({.code = Errc::invalid_argument, .what = "recordings without channels"});
  return {};
}

Status check_recording(const Recording& recording, const std::vector<Channel>& channels) {
  if (recording.label.empty())
    return fail({.code = Errc::invalid_argument, .what = "a recording without label"});
  if (recording.channels != channels || recording.samples.size() != channels.size())
    return fail({.code = Errc::invalid_argument,
                 .what = "other channels than the first recording's",
                 .expected = format_channels(channels),
                 .got = format_channels(recording.channels)});
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto& samples = recording.samples[c];
    if (samples.empty())
      return fail({.code = Errc::invalid_argument,
                   .where = channels[c].name,
                   .what = "a channel without samples"});
    const auto odd = std::ranges::find_if(samples, [](double v) { return !std::isfinite(v); });
    if (odd != samples.end())
      return fail({.code = Errc::invalid_argument,
                   .where = channels[c].name + ": sample " + std::to_string(odd - samples.begin()),
                   .what = "a sample that is not a finite number"});
  }
  return {};
}

}  // namespace

Status check(const RecordingSet& set) {
  if (set.recordings.empty())
    return fail({.code = Errc::invalid_argument, .what = "a data set without recordings"});
  const auto& channels = set.recordings.front().channels;
  if (auto fine = check_channels(channels); !fine) return fine;
  std::set<std::string_view> files;
  for (const Recording& r : set.recordings) {
    if (r.file.empty() || !files.insert(r.file).second)
      return fail({.code = Errc::invalid_argument,
                   .where = r.file,
                   .what = "the name of a recording must be present and unique"});
    if (auto fine = check_recording(r, channels); !fine) return pass(fine.error(), r.file);
  }
  return {};
}

std::string recordings_sha256(const RecordingSet& set) {
  Sha256 hash;
  hash.sized_text("weft-recordings 1");
  hash.sized_text(to_string(set.kind));
  for (const Recording& r : set.recordings) {
    for (const std::string* text : {&r.file, &r.label, &r.group}) hash.sized_text(*text);
    for (std::size_t c = 0; c < r.channels.size(); ++c) {
      hash.sized_text(r.channels[c].name);
      hash.sized_text(r.channels[c].unit);
      hash.number(r.channels[c].rate_hz);
      hash.number(static_cast<std::uint64_t>(r.samples[c].size()));
      hash.numbers(std::span<const double>(r.samples[c]));
    }
  }
  return to_hex(hash.finish());
}

Copies copies_in(const RecordingSet& set) {
  std::vector<std::string> names, contents;
  for (const Recording& r : set.recordings) {
    Sha256 hash;
    for (const auto& samples : r.samples) {
      hash.number(static_cast<std::uint64_t>(samples.size()));
      hash.numbers(std::span<const double>(samples));
    }
    names.push_back(r.file);
    contents.push_back(to_hex(hash.finish()));
  }
  return copies_among(names, contents);
}

}  // namespace weft::daemon
