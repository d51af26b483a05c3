#include "classifier/imprint/image.hpp"

#include <cmath>
#include <string>

namespace weft::classifier::imprint {

Status check(const Image& image) {
  const std::size_t taxels = image.rows() * image.cols();
  if (taxels == 0 || taxels > most_taxels)
    return fail(Errc::invalid_argument, "no imprint has this many taxels", "imprint",
                "1 to " + std::to_string(most_taxels), std::to_string(taxels));
  for (std::size_t r = 0; r < image.rows(); ++r)
    for (std::size_t c = 0; c < image.cols(); ++c)
      if (!(std::abs(image(r, c)) <= largest_count))
        return fail(Errc::range, "a taxel has no usable value",
                    "row " + std::to_string(r) + ", column " + std::to_string(c),
                    "a finite count up to 1e100", std::to_string(image(r, c)));
  return {};
}

}  // namespace weft::classifier::imprint
