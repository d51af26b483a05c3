#include "classifier/base/memory.hpp"

#include <unistd.h>

#include <cmath>

namespace weft::classifier {
namespace {

constexpr double bytes_of_a_number = 8.0;

double gigabytes(std::size_t rows, double matrices) {
  return matrices * bytes_of_a_number * std::pow(static_cast<double>(rows), 2) / 1e9;
}

std::string format_gb(double gb) {
  std::string out = std::to_string(gb);
  out.resize(out.find('.') + 2);
  return out + " GB";
}

}  // namespace

tl::unexpected<Error> out_of_memory(std::size_t rows, const std::string& got) {
  return fail(
      {.code = Errc::range,
       .where = std::to_string(rows) + " feature vectors",
       .what = "too many feature vectors for the memory of this machine",
       .expected = "room for their distances, " + format_gb(gigabytes(rows, 1.0)) + " a matrix",
       .got = got,
       .hint = "Train on fewer of them, such as longer windows or windows that overlap less, or "
               "with --learner lda"});
}

Status check_square_memory(std::size_t rows, double matrices) {
  const double whole_gb = static_cast<double>(sysconf(_SC_PHYS_PAGES)) *
                          static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e9;
  const double needed_gb = gigabytes(rows, matrices);
  if (whole_gb <= 0.0 || needed_gb <= whole_gb) return {};
  return out_of_memory(rows, format_gb(needed_gb) + " needed of " + format_gb(whole_gb));
}

}  // namespace weft::classifier
