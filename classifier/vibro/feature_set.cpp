#include "classifier/vibro/feature_set.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/base/names.hpp"

namespace weft::classifier::vibro {
namespace {

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

std::string unit_of(FrameFeature figure, const std::string& sample_unit) {
  switch (figure) {
    case FrameFeature::mean:
    case FrameFeature::std:
    case FrameFeature::mad:
    case FrameFeature::rmse:
      return sample_unit;
    case FrameFeature::centroid:
    case FrameFeature::bandwidth:
    case FrameFeature::rolloff:
      return "Hz";
    case FrameFeature::perceptual:
      return "dB";
    case FrameFeature::chroma:
    case FrameFeature::zcr:
      break;
  }
  return "1";
}

std::string common_unit(const std::vector<Channel>& channels) {
  const bool same = std::all_of(channels.begin(), channels.end(),
                                [&](const Channel& c) { return c.unit == channels.front().unit; });
  return same && !channels.empty() ? channels.front().unit : "mixed";
}

}  // namespace

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
  return value_from(families, text, "unknown set of features", name_list(families));
}
std::string_view to_string(Combine combine) {
  return name_in(combinations, combine);
}
Result<Combine> combine_from(std::string_view text) {
  return value_from(combinations, text, "unknown way to combine channels", name_list(combinations));
}

std::vector<FrameFeature> features_of_family(Family family) {
  switch (family) {
    case Family::smmrp:
    case Family::smmrpfft:
      return {FrameFeature::mean, FrameFeature::std, FrameFeature::mad, FrameFeature::rmse,
              FrameFeature::perceptual};
    case Family::smmrp10:
    case Family::all:
    case Family::wide:
      return {FrameFeature::mean,      FrameFeature::std,     FrameFeature::mad,
              FrameFeature::rmse,      FrameFeature::chroma,  FrameFeature::centroid,
              FrameFeature::bandwidth, FrameFeature::rolloff, FrameFeature::perceptual,
              FrameFeature::zcr};
    case Family::fft:
    case Family::bands:
      break;
  }
  return {};
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
