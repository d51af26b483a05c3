#include "classifier/vibro/recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "classifier/base/random.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier::vibro {
namespace {

// The last tick at or before `to_s`, up to rounding.
std::size_t last_tick(double to_s) {
  return static_cast<std::size_t>(std::floor(std::max(to_s, 0.0) / window_tick_s + 1e-6));
}

// Per channel, the end of part `b` of `blocks` (after its last sample): the start of the next part,
// or the end of the recording.
std::vector<std::size_t> compute_block_ends(const Recording& recording, std::size_t b,
                                            std::size_t blocks) {
  const double end_s =
      recording.duration_s() / static_cast<double>(blocks) * static_cast<double>(b + 1);
  std::vector<std::size_t> out;
  for (std::size_t c = 0; c < recording.channels.size(); ++c)
    out.push_back(b + 1 == blocks ? recording.samples[c].size()
                                  : first_sample(end_s, recording.channels[c].rate_hz));
  return out;
}

// A window of no whole number of samples may have half a sample more than its seconds. So the check
// needs samples, not only seconds.
bool lies_before(const Recording& recording, double start_s, double window_s,
                 const std::vector<std::size_t>& ends) {
  for (std::size_t c = 0; c < ends.size(); ++c) {
    const double rate = recording.channels[c].rate_hz;
    if (first_sample(start_s, rate) + samples_in(window_s, rate) > ends[c]) return false;
  }
  return true;
}

// True if the window begins before the end of a gap and ends after the gap's start.
bool lies_in_gap(const Recording& recording, double start_s, double window_s) {
  for (const Channel& channel : recording.channels) {
    const std::size_t first = first_sample(start_s, channel.rate_hz);
    const std::size_t end = first + samples_in(window_s, channel.rate_hz);
    for (const Gap& gap : recording.gaps)
      if (first < first_sample(gap.to_s, channel.rate_hz) &&
          end > first_sample(gap.from_s, channel.rate_hz))
        return true;
  }
  return false;
}

// Times where the windows of a part start again: its start, and the end of each gap inside.
std::vector<double> compute_begins(const Recording& recording, double begin_s, double end_s) {
  std::vector<double> out{begin_s};
  for (const Gap& gap : recording.gaps)
    if (gap.to_s > begin_s && gap.to_s < end_s) out.push_back(gap.to_s);
  return out;
}

constexpr NameTable<Family, 7> families = {{
    {Family::smmrp, "SMMRP"},
    {Family::smmrp10, "SMMRP10"},
    {Family::fft, "FFT"},
    {Family::smmrpfft, "SMMRPFFT"},
    {Family::all, "ALL"},
    {Family::bands, "BANDS"},
    {Family::wide, "WIDE"},
}};
constexpr NameTable<Combine, 2> combinations = {
    {{Combine::mean, "mean"}, {Combine::concat, "concat"}}};

// In the order of FrameFeature; empty: unit of a sample.
constexpr std::array<std::string_view, figure_count> figure_units = {"",   "",   "",   "",   "1",
                                                                     "Hz", "Hz", "Hz", "dB", "1"};

std::string unit_of(FrameFeature figure, const std::string& sample_unit) {
  const std::string_view own = figure_units[static_cast<std::size_t>(figure)];
  return own.empty() ? sample_unit : std::string(own);
}

std::string common_unit(const std::vector<Channel>& channels) {
  const bool same = std::all_of(channels.begin(), channels.end(),
                                [&](const Channel& c) { return c.unit == channels.front().unit; });
  return same && !channels.empty() ? channels.front().unit : "mixed";
}

}  // namespace

double Recording::duration_s() const {
  double out = channels.empty() ? 0.0 : std::numeric_limits<double>::infinity();
  for (std::size_t c = 0; c < channels.size() && c < samples.size(); ++c)
    out = std::min(out, static_cast<double>(samples[c].size()) / channels[c].rate_hz);
  return out;
}

std::size_t first_sample(double start_s, double rate_hz) {
  return static_cast<std::size_t>(std::llround(start_s * rate_hz));
}

std::size_t samples_in(double window_s, double rate_hz) {
  return static_cast<std::size_t>(std::llround(window_s * rate_hz));
}

Result<WindowView> window_at(const Recording& recording, double start_s, double window_s) {
  WindowView out;
  for (std::size_t c = 0; c < recording.channels.size(); ++c) {
    const double rate = recording.channels[c].rate_hz;
    const std::size_t first = first_sample(start_s, rate), count = samples_in(window_s, rate);
    const std::vector<double>& own = recording.samples[c];
    if (count == 0)
      return fail({.code = Errc::range,
                   .where = recording.file + ": " + recording.channels[c].name,
                   .what = "window shorter than half a sample period of the channel",
                   .expected = "at least half a sample period at " + format_number(rate) + " Hz",
                   .got = format_number(window_s) + " s",
                   .hint = "Use a longer --window-s"});
    if (first > own.size() || count > own.size() - first)
      return fail({.code = Errc::range,
                   .where = recording.file + ": " + recording.channels[c].name,
                   .what = "window outside the channel",
                   .expected = "within " + std::to_string(own.size()) + " samples",
                   .got = std::to_string(count) + " samples from sample " + std::to_string(first)});
    out.push_back(std::span(own).subspan(first, count));
  }
  if (out.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = recording.file,
                 .what = "recording without channels"});
  return out;
}

std::vector<Place> random_places(const Recording& recording, double window_s, std::size_t count,
                                 std::uint64_t seed) {
  std::vector<Place> all;
  const double duration_s = recording.duration_s();
  if (duration_s + 1e-9 < window_s) return all;
  const std::size_t last = last_tick(duration_s - window_s);
  const std::vector<std::size_t> ends = compute_block_ends(recording, 0, 1);
  for (std::size_t t = 0; t <= last; ++t) {
    const double start_s = static_cast<double>(t) * window_tick_s;
    if (lies_before(recording, start_s, window_s, ends) &&
        !lies_in_gap(recording, start_s, window_s))
      all.push_back({start_s, 0});
  }
  RandomEngine engine(seed);
  shuffle(all, engine);
  if (all.size() > count) all.resize(count);
  return all;
}

std::vector<Place> block_places(const Recording& recording, double window_s, std::size_t blocks,
                                double step_s) {
  std::vector<Place> out;
  const double length = recording.duration_s() / static_cast<double>(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    const double begin = length * static_cast<double>(b), end = begin + length;
    const std::vector<std::size_t> ends = compute_block_ends(recording, b, blocks);
    const std::vector<double> begins = compute_begins(recording, begin, end);
    for (std::size_t r = 0; r < begins.size(); ++r) {
      const double next = r + 1 < begins.size() ? begins[r + 1] : end;
      for (std::size_t i = 0;; ++i) {
        const double start = begins[r] + static_cast<double>(i) * step_s;
        if (start + window_s > next + 1e-9) break;
        if (lies_before(recording, start, window_s, ends) &&
            !lies_in_gap(recording, start, window_s))
          out.push_back({start, b});
      }
    }
  }
  return out;
}

bool same_sensor(const std::vector<Channel>& a, const std::vector<Channel>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Channel& x, const Channel& y) {
    return x.name == y.name && x.unit == y.unit &&
           std::abs(x.rate_hz - y.rate_hz) <= clock_tolerance * x.rate_hz;
  });
}

std::string format_channels(const std::vector<Channel>& channels) {
  std::string out;
  for (const Channel& c : channels)
    out += (out.empty() ? "" : ", ") + c.name + " " + std::to_string(c.rate_hz) + " Hz [" + c.unit +
           "]";
  return out;
}

std::string_view to_string(Family family) {
  return name_in(families, family);
}
Result<Family> family_from(std::string_view text) {
  return value_from(families, text, "unknown feature set", name_list(families));
}
std::string_view to_string(Combine combine) {
  return name_in(combinations, combine);
}
Result<Combine> combine_from(std::string_view text) {
  return value_from(combinations, text, "unknown channel combination", name_list(combinations));
}

std::vector<FrameFeature> features_of_family(Family family) {
  if (family == Family::fft || family == Family::bands) return {};
  if (family == Family::smmrp || family == Family::smmrpfft)
    return {FrameFeature::mean, FrameFeature::std, FrameFeature::mad, FrameFeature::rmse,
            FrameFeature::perceptual};
  std::vector<FrameFeature> out;
  for (std::size_t k = 0; k < figure_count; ++k) out.push_back(static_cast<FrameFeature>(k));
  return out;
}

bool has_fft(Family family) {
  return family == Family::fft || family == Family::smmrpfft || family == Family::all ||
         family == Family::wide;
}

bool has_bands(Family family) {
  return family == Family::bands || family == Family::wide;
}

std::vector<Column> columns_of(const std::vector<Channel>& channels, FeatureChoice choice) {
  std::vector<Column> out;
  const auto figures = features_of_family(choice.family);
  if (choice.combine == Combine::mean) {
    for (const FrameFeature f : figures)
      out.push_back({std::string(to_string(f)), unit_of(f, common_unit(channels))});
  } else {
    for (const Channel& c : channels)
      for (const FrameFeature f : figures)
        out.push_back({std::string(to_string(f)) + "." + c.name, unit_of(f, c.unit)});
  }
  if (has_fft(choice.family))
    for (const Channel& c : channels) out.push_back({"FFT." + c.name, c.unit});
  if (!has_bands(choice.family)) return out;
  for (std::size_t c = 0; c < (choice.combine == Combine::mean ? 1 : channels.size()); ++c)
    for (const char* what : {"BAND", "BANDSTD"})
      for (std::size_t b = 1; b <= band_count; ++b)
        out.push_back({what + std::to_string(b) +
                           (choice.combine == Combine::mean ? "" : "." + channels[c].name),
                       "dB"});
  return out;
}

}  // namespace weft::classifier::vibro
