#include "classifier/evaluate/confusion.hpp"

#include <numeric>

namespace weft::classifier {
namespace {

double share(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::size_t Confusion::total() const {
  return std::accumulate(count.begin(), count.end(), std::size_t{0});
}

std::size_t Confusion::correct() const {
  std::size_t sum = 0;
  for (std::size_t k = 0; k < classes(); ++k) sum += at(k, k);
  return sum;
}

double Confusion::accuracy() const {
  return share(correct(), total());
}

std::vector<double> Confusion::recall() const {
  std::vector<double> out;
  for (std::size_t t = 0; t < classes(); ++t) {
    std::size_t trials = 0;
    for (std::size_t p = 0; p < classes(); ++p) trials += at(t, p);
    out.push_back(share(at(t, t), trials));
  }
  return out;
}

}  // namespace weft::classifier
