#include "classifier/evaluate/twins.hpp"

#include <algorithm>
#include <map>
#include <vector>

namespace weft::classifier {
namespace {

// The first of the rows with the same features, for every row.
std::vector<std::size_t> first_alike(const FeatureMatrix& matrix) {
  const auto before = [&matrix](std::size_t a, std::size_t b) {
    return std::ranges::lexicographical_compare(matrix.values.row(a), matrix.values.row(b));
  };
  std::map<std::size_t, std::size_t, decltype(before)> first(before);
  std::vector<std::size_t> out;
  for (std::size_t r = 0; r < matrix.size(); ++r) out.push_back(first.emplace(r, r).first->second);
  return out;
}

}  // namespace

Twins twins_of(const FeatureMatrix& matrix, std::span<const Split> splits) {
  const std::vector<std::size_t> alike = first_alike(matrix);
  Twins out;
  for (const Split& split : splits) {
    std::map<std::size_t, std::size_t> trained;  // a training row, by the first one like it
    for (const std::size_t r : split.train) trained.emplace(alike[r], r);
    for (const std::size_t r : split.test) {
      ++out.tested;
      const auto twin = trained.find(alike[r]);
      if (twin == trained.end()) continue;
      if (out.found++ > 0) continue;
      out.test = matrix.files[r];
      out.train = matrix.files[twin->second];
    }
  }
  return out;
}

}  // namespace weft::classifier
