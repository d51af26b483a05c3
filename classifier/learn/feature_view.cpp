#include "classifier/learn/feature_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace weft::classifier {
namespace {

constexpr std::array views = {std::pair{View::plain, std::string_view("plain")},
                              std::pair{View::compressed, std::string_view("compressed")},
                              std::pair{View::ranked, std::string_view("ranked")}};

// As the scaler has it: a spread of rounding only says nothing.
constexpr double constant_tolerance = 1e-12;

double compress(double z) {
  return std::copysign(std::log1p(std::abs(z)), z);
}

// (value - low) / (high - low); differences of values up to 1e308 must not overflow.
double share(double low, double value, double high) {
  if (std::isfinite(high - low)) return (value - low) / (high - low);
  return (value / 2 - low / 2) / (high / 2 - low / 2);
}

// Value at a place of sorted values, linear between them; `at` from 0 to size - 1.
double value_at(const std::vector<double>& sorted, double at) {
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return std::lerp(sorted[low], sorted[high], at - static_cast<double>(low));
}

// Where the middle of part `k` of `parts` lies among `size` sorted values.
double quantile_place(std::size_t k, std::size_t parts, std::size_t size) {
  return (static_cast<double>(k) + 0.5) / static_cast<double>(parts) * static_cast<double>(size) -
         0.5;
}

// Place (from 0) of the first row that is not `before(value)`, in a column that does not fall.
template <class Before>
std::size_t first_not(const Matrix& knots, std::size_t column, Before before) {
  std::size_t low = 0, high = knots.rows();
  while (low < high) {
    const std::size_t middle = low + (high - low) / 2;
    if (before(knots(middle, column)))
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

}  // namespace

std::string_view to_string(View view) {
  return views[static_cast<std::size_t>(view)].second;
}

Result<View> view_from(std::string_view text) {
  for (const auto& [view, name] : views)
    if (name == text) return view;
  return fail(Errc::invalid_argument, "unknown view of the features", {},
              "plain, compressed or ranked", std::string(text));
}

std::vector<View> all_views() {
  std::vector<View> out;
  for (const auto& entry : views) out.push_back(entry.first);
  return out;
}

RankTable RankTable::fit(const Matrix& rows) {
  const std::size_t count = std::min(rows.rows(), most_knots);
  Matrix knots(count, rows.cols());
  std::vector<double> sorted(rows.rows());
  for (std::size_t c = 0; c < rows.cols(); ++c) {
    for (std::size_t r = 0; r < rows.rows(); ++r) sorted[r] = rows(r, c);
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t k = 0; k < count; ++k)
      knots(k, c) = count == sorted.size()
                        ? sorted[k]
                        : value_at(sorted, quantile_place(k, count, sorted.size()));
  }
  return RankTable(std::move(knots));
}

double RankTable::place(std::size_t feature, double value) const {
  const std::size_t count = knots_.rows();
  const double least = knots_(0, feature), most = knots_(count - 1, feature);
  const double top = std::max(std::abs(least), std::abs(most));
  if (most / 2 - least / 2 <= constant_tolerance * (top / 2)) return 0.5;
  const std::size_t below = first_not(knots_, feature, [&](double knot) { return knot < value; });
  const std::size_t after = first_not(knots_, feature, [&](double knot) { return knot <= value; });
  double at = 0.0;
  if (after > below)
    at = (static_cast<double>(below) + static_cast<double>(after) - 1.0) / 2.0;
  else if (below == count)
    at = static_cast<double>(count) - 1.0;
  else if (below > 0)
    at = static_cast<double>(below) - 1.0 +
         share(knots_(below - 1, feature), value, knots_(below, feature));
  return (at + 0.5) / static_cast<double>(count);
}

FeatureView FeatureView::fit(View view, const Matrix& rows) {
  if (view == View::compressed) return FeatureView(Table(fit_scaler(rows)));
  if (view == View::ranked) return FeatureView(Table(RankTable::fit(rows)));
  return {};
}

void FeatureView::apply(std::span<double> features) const {
  if (const auto* scaler = std::get_if<Scaler>(&table_))
    for (std::size_t k = 0; k < features.size(); ++k)
      features[k] = compress(scaler->apply(k, features[k]));
  if (const auto* ranks = std::get_if<RankTable>(&table_))
    for (std::size_t k = 0; k < features.size(); ++k) features[k] = ranks->place(k, features[k]);
}

void FeatureView::apply(Matrix& rows) const {
  for (std::size_t r = 0; r < rows.rows(); ++r) apply(rows.row(r));
}

}  // namespace weft::classifier
