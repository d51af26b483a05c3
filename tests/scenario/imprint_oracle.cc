// Our imprint module on images given as text, for imprint_oracle.py.
//
//   imprint_oracle features SIGMAS NOISE ORIENTATION < IMAGES
//
// SIGMAS: 0,1,2.5; NOISE: gradient or literal; ORIENTATION: circular or linear. IMAGES: rows, cols
// and their values, one image after the other. Prints one line of ten numbers a scale and image, 17
// digits.

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

#include "classifier/imprint/scale_features.hpp"

namespace {

using namespace weft::classifier::imprint;

template <class T>
T or_exit(weft::Result<T>&& result) {
  if (result) return std::move(*result);
  std::cerr << to_string(result.error()) << "\n";
  std::exit(1);
}

bool read_image(Image& out) {
  std::size_t rows = 0, cols = 0;
  if (!(std::cin >> rows >> cols)) return false;
  out.assign(rows, cols);
  for (double& value : out.data()) std::cin >> value;
  return true;
}

ScaleOptions options_of(char** argument) {
  ScaleOptions out;
  out.sigmas.clear();
  std::stringstream sigmas(argument[0]);
  for (std::string cell; std::getline(sigmas, cell, ',');) out.sigmas.push_back(std::stod(cell));
  if (std::string(argument[1]) == "literal") out.noise = NoiseForm::literal;
  if (std::string(argument[2]) == "linear") out.orientation = OrientationSpread::linear;
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5 || std::string(argv[1]) != "features") {
    std::fprintf(stderr, "usage: features SIGMAS NOISE ORIENTATION < IMAGES\n");
    return 2;
  }
  std::ios::sync_with_stdio(false);
  ScaleFeatures features = or_exit(ScaleFeatures::make(options_of(argv + 2)));
  for (Image image; read_image(image);) {
    std::size_t at = 0;
    for (const double value : or_exit(features.extract(image)))
      std::printf("%.17g%c", value, ++at % feature_kinds().size() == 0 ? '\n' : ' ');
  }
  return 0;
}
