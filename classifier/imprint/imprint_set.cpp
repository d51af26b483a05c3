#include "classifier/imprint/imprint_set.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <string_view>

#include "classifier/base/parallel.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier::imprint {

Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const FeaturePlan& plan,
                                   std::size_t threads) {
  if (imprints.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "imprints",
                 .what = "no imprints",
                 .expected = "at least one"});
  const Image& first = imprints.front().image;
  const auto features = PlannedFeatures::make(plan, first.rows(), first.cols());
  if (!features) return pass(features.error());
  FeatureMatrix out;
  out.names = features->names();
  out.values.assign(imprints.size(), out.names.size());
  std::vector<std::optional<Error>> problems(imprints.size());
  parallel_workers(imprints.size(), threads, [&] {
    return [&, own = *features](std::size_t i) mutable {
      const auto row = own.extract(imprints[i].image);
      if (row)
        std::copy(row->begin(), row->end(), out.values.row(i).begin());
      else
        problems[i] = row.error();
    };
  });
  for (std::size_t i = 0; i < imprints.size(); ++i) {
    if (problems[i]) return pass(*problems[i], imprints[i].file);
    out.labels.push_back(imprints[i].label);
    out.groups.push_back(imprints[i].object);
    out.files.push_back(imprints[i].file);
  }
  if (auto ok = classifier::check(out); !ok) return pass(ok.error());
  return out;
}

Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const ScaleOptions& options,
                                   std::size_t threads) {
  return build_matrix(imprints, FeaturePlan{options, {}, false}, threads);
}

Classes find_classes(std::span<const std::string> labels) {
  Classes out;
  for (const std::string& label : labels) {
    const auto at = std::find(out.names.begin(), out.names.end(), label);
    out.of_row.push_back(static_cast<std::size_t>(at - out.names.begin()));
    if (at == out.names.end()) out.names.push_back(label);
  }
  return out;
}

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
         .what = "imprint of another array",
         .expected = format_grid(grid),
         .got = std::to_string(image.rows()) + " x " + std::to_string(image.cols()) + " taxels"});
  if (grid.count_bits == 0) return {};
  const double highest = std::exp2(static_cast<double>(grid.count_bits)) - 1.0;
  const auto beyond = std::ranges::find_if(
      image.data(), [=](double count) { return !(count >= 0.0 && count <= highest); });
  if (beyond == image.data().end()) return {};
  return fail({.code = Errc::invalid_argument,
               .where = imprint.file,
               .what = "count outside the range of the array",
               .expected = format_grid(grid),
               .got = format_number(*beyond)});
}

Result<PlannedFeatures> PlannedFeatures::make(const FeaturePlan& plan, std::size_t rows,
                                              std::size_t cols) {
  PlannedFeatures out;
  out.maps_ = plan.maps;
  out.rows_ = rows;
  out.cols_ = cols;
  if (plan.scales) {
    auto scales = ScaleFeatures::make(*plan.scales);
    if (!scales) return pass(scales.error());
    out.names_ = scales->names();
    out.scales_ = std::move(*scales);
  }
  for (const LawsSize size : plan.laws) {
    if (std::ranges::find(out.laws_, size) != out.laws_.end())
      return fail({.code = Errc::invalid_argument,
                   .where = "laws",
                   .what = "size of Laws' masks given twice",
                   .expected = "each size once"});
    out.laws_.push_back(size);
    const auto names = laws_names(size);
    out.names_.insert(out.names_.end(), names.begin(), names.end());
  }
  if (plan.maps) {
    const auto names = map_names(rows, cols);
    out.names_.insert(out.names_.end(), names.begin(), names.end());
  }
  if (out.names_.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "features",
                 .what = "no features selected",
                 .expected = "scales, Laws' energies, or maps of at least 2 x 2 taxels",
                 .got = "none"});
  return out;
}

Result<std::vector<double>> PlannedFeatures::extract(const Image& image) {
  if (maps_ && (image.rows() != rows_ || image.cols() != cols_))
    return fail({.code = Errc::invalid_argument,
                 .where = "maps",
                 .what = "imprint of another array",
                 .expected = std::to_string(rows_) + " x " + std::to_string(cols_) + " taxels",
                 .got = std::to_string(image.rows()) + " x " + std::to_string(image.cols())});
  std::vector<double> out;
  out.reserve(names_.size());
  if (scales_) {
    const auto values = scales_->extract(image);
    if (!values) return pass(values.error());
    out.assign(values->begin(), values->end());
  }
  for (const LawsSize size : laws_) {
    const auto values = laws_energy(image, size);
    if (!values) return pass(values.error());
    out.insert(out.end(), values->begin(), values->end());
  }
  if (maps_) {
    const auto values = contact_maps(image);
    if (!values) return pass(values.error());
    out.insert(out.end(), values->begin(), values->end());
  }
  return out;
}

namespace {

constexpr std::array<std::size_t, 3> pool_sides{2, 4, 8};

// Calls use(side, first row, first column) for every pool.
template <class Use>
void for_each_pool(std::size_t rows, std::size_t cols, const Use& use) {
  for (const std::size_t side : pool_sides) {
    if (side > rows || side > cols) continue;
    for (std::size_t r = 0; r < rows; r += side)
      for (std::size_t c = 0; c < cols; c += side) use(side, r, c);
  }
}

}  // namespace

std::vector<std::string> map_names(std::size_t rows, std::size_t cols) {
  std::vector<std::string> out;
  for_each_pool(rows, cols, [&](std::size_t side, std::size_t r, std::size_t c) {
    out.push_back(std::string(map_prefix) + std::to_string(side) + ".r" + std::to_string(r / side) +
                  "c" + std::to_string(c / side));
  });
  return out;
}

Result<std::vector<double>> contact_maps(const Image& image) {
  if (auto ok = check(image); !ok) return pass(ok.error());
  double whole = 0.0;
  for (const double count : image.data()) whole += std::abs(count);
  std::vector<double> out;
  for_each_pool(image.rows(), image.cols(), [&](std::size_t side, std::size_t r, std::size_t c) {
    const std::size_t below = std::min(r + side, image.rows()),
                      right = std::min(c + side, image.cols());
    double sum = 0.0;
    for (std::size_t i = r; i < below; ++i)
      for (std::size_t k = c; k < right; ++k) sum += image(i, k);
    const auto taxels = static_cast<double>((below - r) * (right - c));
    out.push_back(whole == 0.0 ? 0.0 : sum / taxels / whole);
  });
  return out;
}

namespace {

struct Vector {
  std::string_view name;
  std::vector<double> weights;
};

std::vector<Vector> make_vectors(LawsSize size) {
  if (size == LawsSize::three) return {{"L3", {1, 2, 1}}, {"E3", {-1, 0, 1}}, {"S3", {-1, 2, -1}}};
  return {{"L5", {1, 4, 6, 4, 1}},
          {"E5", {-1, -2, 0, 2, 1}},
          {"S5", {-1, 0, 2, 0, -1}},
          {"W5", {-1, 2, 0, -2, 1}},
          {"R5", {1, -4, 6, -4, 1}}};
}

// Convolves down the columns, where the whole mask lies inside.
Image down(const Image& image, std::span<const double> weights) {
  Image out(image.rows() + 1 - weights.size(), image.cols());
  for (std::size_t r = 0; r < out.rows(); ++r)
    for (std::size_t k = 0; k < weights.size(); ++k)
      for (std::size_t c = 0; c < out.cols(); ++c) out(r, c) += weights[k] * image(r + k, c);
  return out;
}

double mean_along(const Image& image, std::span<const double> weights) {
  double sum = 0.0;
  const std::size_t cols = image.cols() + 1 - weights.size();
  for (std::size_t r = 0; r < image.rows(); ++r)
    for (std::size_t c = 0; c < cols; ++c) {
      double value = 0.0;
      for (std::size_t k = 0; k < weights.size(); ++k) value += weights[k] * image(r, c + k);
      sum += std::abs(value);
    }
  return sum / static_cast<double>(image.rows() * cols);
}

}  // namespace

std::vector<std::string> laws_names(LawsSize size) {
  std::vector<std::string> out;
  const auto vectors = make_vectors(size);
  for (const Vector& a : vectors)
    for (const Vector& b : vectors)
      if (&a != &vectors.front() || &b != &vectors.front())
        out.push_back("laws." + std::string(a.name) + std::string(b.name));
  return out;
}

Result<std::vector<double>> laws_energy(const Image& image, LawsSize size) {
  if (auto ok = check(image); !ok) return pass(ok.error());
  const auto vectors = make_vectors(size);
  const std::size_t width = vectors.front().weights.size();
  std::vector<double> out;
  if (image.rows() < width || image.cols() < width) {
    out.assign(vectors.size() * vectors.size() - 1, 0.0);
    return out;
  }
  for (const Vector& a : vectors) {
    const Image lines = down(image, a.weights);
    for (const Vector& b : vectors)
      if (&a != &vectors.front() || &b != &vectors.front())
        out.push_back(mean_along(lines, b.weights));
  }
  return out;
}

}  // namespace weft::classifier::imprint
