#include "classifier/vibro/extract.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <string>

#include "classifier/base/parallel.hpp"
#include "classifier/features/trial.hpp"

namespace weft::classifier::vibro {
namespace {

Status check_channels(const std::vector<Channel>& channels) {
  if (channels.empty())
    return fail({.code = Errc::invalid_argument, .what = "no channels selected"});
  std::set<std::string> names;
  for (const Channel& c : channels) {
    if (!(c.rate_hz > 0.0) || !std::isfinite(c.rate_hz))
      return fail({.code = Errc::invalid_argument,
                   .where = c.name,
                   .what = "sampling rate of the channel out of range",
                   .expected = "above 0 Hz",
                   .got = std::to_string(c.rate_hz)});
    if (!names.insert(c.name).second)
      return fail({.code = Errc::invalid_argument,
                   .where = c.name,
                   .what = "two channels with the same name"});
  }
  return {};
}

Status check_same_channels(std::span<const Recording> recordings) {
  for (const Recording& r : recordings)
    if (r.channels != recordings.front().channels || r.samples.size() != r.channels.size())
      return fail({.code = Errc::invalid_argument,
                   .where = r.file,
                   .what = "channels differ from the first recording",
                   .expected = std::to_string(recordings.front().channels.size()) +
                               " channels as in " + recordings.front().file,
                   .got = std::to_string(r.channels.size())});
  return {};
}

}  // namespace

namespace {

// The block of each window of a recording. If all are in one block, the fifth of the recording's
// windows by time. Windows on both sides of a fold then only overlap where fifths meet.
std::vector<std::size_t> parts_of(const std::vector<Place>& places) {
  constexpr std::size_t fifths = 5;
  std::vector<std::size_t> out;
  for (const Place& place : places) out.push_back(place.block);
  if (std::ranges::any_of(out, [](std::size_t block) { return block > 0; })) return out;
  std::vector<std::size_t> order = numbers_below(places.size());
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return places[i].start_s; });
  for (std::size_t k = 0; k < order.size(); ++k) out[order[k]] = k * fifths / order.size();
  return out;
}

}  // namespace

WindowSet lay_out(std::span<const Recording> recordings, double window_s, const PlacesOf& places) {
  WindowSet out;
  out.window_s = window_s;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    for (const Channel& channel : recordings[r].channels) out.rates_hz.insert(channel.rate_hz);
    std::size_t k = 0;
    const std::vector<Place> own = places(recordings[r]);
    std::ranges::copy(parts_of(own), std::back_inserter(out.matrix.parts));
    for (const Place& place : own) {
      out.places.push_back(place);
      out.recording.push_back(r);
      out.matrix.files.push_back(window_name(recordings[r].file, k++));
      out.matrix.labels.push_back(recordings[r].label);
      out.matrix.groups.push_back(recordings[r].group);
    }
    if (k == 0) out.too_short.push_back({recordings[r].file, recordings[r].label});
  }
  return out;
}

Result<WindowExtractor> WindowExtractor::make(std::vector<Channel> channels, FeatureChoice choice) {
  if (auto ok = check_channels(channels); !ok) return pass(ok.error());
  return WindowExtractor(std::move(channels), choice);
}

WindowExtractor::WindowExtractor(std::vector<Channel> channels, FeatureChoice choice)
    : channels_(std::move(channels)),
      choice_(choice),
      figures_(features_of_family(choice.family)),
      columns_(columns_of(channels_, choice)) {
  for (const Channel& c : channels_) extractors_.emplace_back(c.rate_hz);
}

// Appends values side by side, or adds them to their mean over the channels.
void WindowExtractor::append(std::size_t channel, std::span<const double> values,
                             std::vector<double>& to) const {
  if (choice_.combine == Combine::concat) {
    to.insert(to.end(), values.begin(), values.end());
    return;
  }
  if (channel == 0) to.assign(values.size(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i)
    to[i] += values[i] / static_cast<double>(channels_.size());
}

Status WindowExtractor::append(std::size_t channel, std::span<const double> samples) {
  const bool bands = has_bands(choice_.family);
  if (figures_.empty() && !bands) return {};
  const bool chroma =
      std::find(figures_.begin(), figures_.end(), FrameFeature::chroma) != figures_.end();
  BandFeatures in_bands{};
  const auto all = extractors_[channel].figures(samples, chroma, bands ? &in_bands : nullptr);
  if (!all) return pass(all.error(), channels_[channel].name);
  std::vector<double> own;
  for (const FrameFeature f : figures_) own.push_back((*all)[static_cast<std::size_t>(f)]);
  append(channel, own, features_);
  if (bands) append(channel, in_bands, bands_);
  return {};
}

Result<std::span<const double>> WindowExtractor::features(const WindowView& window) {
  if (window.size() != channels_.size())
    return fail({.code = Errc::invalid_argument,
                 .what = "wrong number of channels in the window",
                 .expected = std::to_string(channels_.size()),
                 .got = std::to_string(window.size())});
  features_.clear();
  bands_.clear();
  for (std::size_t c = 0; c < window.size(); ++c)
    if (auto ok = append(c, window[c]); !ok) return pass(ok.error());
  if (has_fft(choice_.family)) {
    for (std::size_t c = 0; c < window.size(); ++c) {
      const auto amplitude = extractors_[c].mean_amplitude(window[c]);
      if (!amplitude) return pass(amplitude.error(), channels_[c].name);
      features_.push_back(*amplitude);
    }
  }
  features_.insert(features_.end(), bands_.begin(), bands_.end());
  return std::span<const double>(features_);
}

Result<WindowSet> cut_and_extract(std::span<const Recording> recordings, double window_s,
                                  const PlacesOf& places, FeatureChoice choice,
                                  std::size_t threads) {
  if (recordings.empty())
    return fail({.code = Errc::invalid_argument, .what = "no recordings to cut into windows"});
  if (auto ok = check_same_channels(recordings); !ok) return pass(ok.error());
  auto made = WindowExtractor::make(recordings.front().channels, choice);
  if (!made) return pass(made.error());
  WindowSet out = lay_out(recordings, window_s, places);
  for (const Column& c : made->columns()) out.matrix.names.push_back(c.name);
  out.matrix.values = Matrix(out.places.size(), made->columns().size());
  std::vector<std::optional<Error>> refused(out.places.size());
  parallel_blocks(out.places.size(), threads, [&](std::size_t from, std::size_t to) {
    auto own = WindowExtractor::make(recordings.front().channels, choice);
    for (std::size_t i = from; i < to; ++i) {
      const auto window = window_at(recordings[out.recording[i]], out.places[i].start_s, window_s);
      const auto row = window ? own->features(*window) : pass(window.error());
      if (row) {
        std::copy(row->begin(), row->end(), out.matrix.values.row(i).begin());
      } else {
        refused[i] = row.error();
      }
    }
  });
  for (std::size_t i = 0; i < refused.size(); ++i)
    if (refused[i]) return pass(std::move(*refused[i]), out.matrix.files[i]);
  return out;
}

}  // namespace weft::classifier::vibro
