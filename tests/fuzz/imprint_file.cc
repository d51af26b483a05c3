// Imprints in the formats of other programs (text, grey maps, NumPy arrays), and their features.

#include <cmath>

#include "classifier/imprint/scale_features.hpp"
#include "daemon/storage/imprints/image_file.hpp"
#include "tests/fuzz/target.hpp"

namespace weft::fuzz::imprint_file_target {
namespace {

using classifier::imprint::Image;

void inspect(const Result<Image>& image) {
  if (!image) return demand(!image.error().what.empty(), "an error says what is wrong");
  demand(image->rows() > 0 && image->cols() > 0, "an imprint that was read has taxels");
  if (!classifier::imprint::check(*image) || image->data().size() > 4096) return;
  auto features = classifier::imprint::ScaleFeatures::make({.sigmas = {0, 1}});
  const auto values = features->extract(*image);
  demand(values.has_value(), "a checked imprint has features");
  for (const double value : *values) demand(std::isfinite(value), "features are finite");
}

}  // namespace

WEFT_FUZZ_TARGET(imprint_file) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  inspect(weft::daemon::parse_image_csv("input", text));
  inspect(weft::daemon::parse_image_pgm("input", text));
  inspect(weft::daemon::parse_image_npy("input", text));
  return 0;
}

}  // namespace weft::fuzz::imprint_file_target
