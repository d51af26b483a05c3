// Computes the features of windows given as bytes, for vibro_agreement.py.
//
//   vibro_agreement < WINDOWS    per window: uint64 samples, double rate_hz, the samples as doubles
//                                (native byte order); a line of the ten features and FFT, 17 digits

#include <cstdint>
#include <cstdio>
#include <iostream>
#include <map>
#include <vector>

#include "classifier/vibro/channel_features.hpp"

namespace {

using namespace weft;
using namespace weft::classifier::vibro;

template <class T>
bool read(T* out, std::size_t count) {
  return static_cast<bool>(
      std::cin.read(reinterpret_cast<char*>(out), static_cast<std::streamsize>(count * sizeof(T))));
}

int refuse(const Error& error) {
  std::cerr << to_string(error) << "\n";
  return 1;
}

}  // namespace

int main() {
  std::map<double, ChannelExtractor> extractors;
  std::uint64_t count = 0;
  double rate_hz = 0.0;
  while (read(&count, 1) && read(&rate_hz, 1)) {
    std::vector<double> samples(count);
    if (!read(samples.data(), samples.size())) return 1;
    ChannelExtractor& own = extractors.try_emplace(rate_hz, rate_hz).first->second;
    const auto figures = own.figures(samples);
    if (!figures) return refuse(figures.error());
    const auto fft = own.mean_amplitude(samples);
    if (!fft) return refuse(fft.error());
    for (const double v : *figures) std::printf("%.17g,", v);
    std::printf("%.17g\n", *fft);
  }
  return 0;
}
