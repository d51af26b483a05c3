#pragma once
// Recordings of noise with a level that depends on the label, cut and split by a protocol.

#include <string>
#include <vector>

#include "classifier/vibro/protocol.hpp"
#include "tests/unit/classifier/features_support.hpp"

namespace weft::classifier::vibro::noise_levels {

inline const std::vector<Channel> one_channel = {{"X", 200.0, "count"}};

// Noise with a level that depends on the label; `recordings` of each, groups "1", "2" ...
inline std::vector<Recording> levels(std::size_t labels, std::size_t recordings,
                                     double seconds = 15.0) {
  std::vector<Recording> out;
  for (std::size_t l = 0; l < labels; ++l) {
    for (std::size_t r = 0; r < recordings; ++r) {
      Recording own;
      own.label = std::string(1, static_cast<char>('a' + l));
      own.group = std::to_string(r + 1);
      own.file = own.label + own.group;
      own.channels = one_channel;
      own.samples = {classifier::testing::noise(samples_in(seconds, 200.0), 100 * l + r)};
      for (double& v : own.samples[0]) v *= 1.0 + static_cast<double>(l);
      out.push_back(std::move(own));
    }
  }
  return out;
}

struct Cut {
  WindowSet windows;
  std::vector<Split> splits;
};

inline Cut cut(const std::vector<Recording>& recordings, const ProtocolOptions& options,
               FeatureChoice choice = {Family::smmrp, Combine::concat}) {
  Cut out;
  out.windows = cut_and_extract(recordings, options.window_s, places_of(options), choice).value();
  out.splits = split_windows(out.windows, options).value();
  return out;
}

inline ProtocolOptions with(Protocol protocol) {
  ProtocolOptions out;
  out.protocol = protocol;
  return out;
}

}  // namespace weft::classifier::vibro::noise_levels
