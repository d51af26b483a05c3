#include "classifier/imprint/taxel_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "protocols/base/number_text.hpp"

namespace weft::classifier::imprint {
namespace {

constexpr double largest_pitch_difference = 0.01;

std::string millimetres(double metres) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g mm", 1e3 * metres);
  return text.data();
}

}  // namespace

bool is_same_grid(const TaxelGrid& a, const TaxelGrid& b) {
  if (a.rows != b.rows || a.cols != b.cols) return false;
  if (a.count_bits != 0 && b.count_bits != 0 && a.count_bits != b.count_bits) return false;
  if (a.pitch_m == 0.0 || b.pitch_m == 0.0) return true;
  return std::abs(a.pitch_m / b.pitch_m - 1.0) <= largest_pitch_difference;
}

std::string format_grid(const TaxelGrid& grid) {
  return std::to_string(grid.rows) + " x " + std::to_string(grid.cols) + " taxels, " +
         (grid.pitch_m == 0.0 ? "pitch not known" : millimetres(grid.pitch_m) + " apart") + ", " +
         (grid.count_bits == 0 ? "bits of a count not known"
                               : "counts of " + std::to_string(grid.count_bits) + " bits");
}

Status check_imprint(const TaxelGrid& grid, const Imprint& imprint) {
  const Image& image = imprint.image;
  if (image.rows() != grid.rows || image.cols() != grid.cols)
    return fail(
        {.code = Errc::invalid_argument,
         .where = imprint.file,
         .what = "the imprint is of another array",
         .expected = format_grid(grid),
         .got = std::to_string(image.rows()) + " x " + std::to_string(image.cols()) + " taxels"});
  if (grid.count_bits == 0) return {};
  const double highest = std::exp2(static_cast<double>(grid.count_bits)) - 1.0;
  const auto beyond = std::ranges::find_if(
      image.data(), [=](double count) { return !(count >= 0.0 && count <= highest); });
  if (beyond == image.data().end()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = imprint.file,
               .what = "the imprint has a count that its array cannot give",
               .expected = format_grid(grid),
               .got = format_number(*beyond)});
}

}  // namespace weft::classifier::imprint
