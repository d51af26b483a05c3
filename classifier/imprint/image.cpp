#include "classifier/imprint/image.hpp"

#include <cmath>
#include <string>

namespace weft::classifier::imprint {

Status check(const Image& image) {
  const std::size_t taxels = image.rows() * image.cols();
  if (taxels == 0 || taxels > most_taxels)
    return fail({.code = Errc::invalid_argument,
                 .where = "imprint",
                 .what = "no imprint has this many taxels",
                 .expected = "1 to " + std::to_string(most_taxels),
                 .got = std::to_string(taxels)});
  for (std::size_t r = 0; r < image.rows(); ++r)
    for (std::size_t c = 0; c < image.cols(); ++c)
      if (!(std::abs(image(r, c)) <= largest_count))
        return fail({.code = Errc::range,
                     .where = "row " + std::to_string(r) + ", column " + std::to_string(c),
                     .what = "a taxel has no usable value",
                     .expected = "a finite count up to 1e100",
                     .got = std::to_string(image(r, c))});
  return {};
}

}  // namespace weft::classifier::imprint
