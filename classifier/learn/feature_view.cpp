#include "classifier/learn/feature_view.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "classifier/selection/selection.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier {
namespace {

constexpr NameTable<View, 6> view_names = {{
    {View::plain, "plain"},
    {View::compressed, "compressed"},
    {View::ranked, "ranked"},
    {View::normal_scores, "normal-scores"},
    {View::standardised, "standardised"},
    {View::components, "components"},
}};

double compress(double z) {
  return std::copysign(std::log1p(std::abs(z)), z);
}

// (value - low) / (high - low); differences of values up to 1e308 must not overflow.
double share(double low, double value, double high) {
  if (std::isfinite(high - low)) return (value - low) / (high - low);
  return (value / 2 - low / 2) / (high / 2 - low / 2);
}

// Value at a position of sorted values, linear between them; `at` from 0 to size - 1.
double value_at(const std::vector<double>& sorted, double at) {
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return std::lerp(sorted[low], sorted[high], at - static_cast<double>(low));
}

// Position of the middle of part `k` of `parts` among `size` sorted values.
double quantile_place(std::size_t k, std::size_t parts, std::size_t size) {
  return (static_cast<double>(k) + 0.5) / static_cast<double>(parts) * static_cast<double>(size) -
         0.5;
}

// Index of the first row that is not `before(value)`, in a non-decreasing column.
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

// Quantile of the normal distribution at `share` <= 1/2. Newton's method starts from 0. On this
// side the distribution is convex, so the steps descend and never overshoot, until rounding stops
// them.
double normal_quantile(double share) {
  const double density_at_0 = std::numbers::inv_sqrtpi / std::numbers::sqrt2;
  for (double z = 0.0;;) {
    const double below = 0.5 * std::erfc(-z / std::numbers::sqrt2);
    const double next = z - (below - share) / (density_at_0 * std::exp(-0.5 * z * z));
    if (!(next < z)) return z;
    z = next;
  }
}

// Spread that is only rounding must not be scaled to unit variance or beyond.
constexpr double constant_unit = 1e-9;

void fit_column(const Matrix& rows, std::size_t k, Scaler& out) {
  const auto n = static_cast<double>(rows.rows());
  double top = 0.0;
  for (std::size_t r = 0; r < rows.rows(); ++r) top = std::max(top, std::abs(rows(r, k)));
  const double unit = top > 0.0 ? top : 1.0;  // squares of values up to 1e300 must not overflow
  double sum = 0.0;
  for (std::size_t r = 0; r < rows.rows(); ++r) sum += rows(r, k) / unit;
  const double mean = sum / n;
  double square = 0.0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const double d = rows(r, k) / unit - mean;
    square += d * d;
  }
  const double deviation = std::sqrt(square / n);
  out.mean[k] = mean * unit;
  const double spread = deviation > rounding_spread ? deviation * unit : 0.0;
  out.deviation[k] = spread > 0.0 ? spread : std::max(1.0, constant_unit * top);
}

}  // namespace

std::string_view to_string(View view) {
  return name_in(view_names, view);
}

Result<View> view_from(std::string_view text) {
  return value_from(view_names, text, "unknown feature view", name_list(view_names));
}

std::vector<View> tried_views() {
  return {View::plain, View::compressed, View::ranked, View::normal_scores};
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

double RankTable::position(std::size_t feature, double value) const {
  const std::size_t count = knots_.rows();
  const double least = knots_(0, feature), most = knots_(count - 1, feature);
  const double top = std::max(std::abs(least), std::abs(most));
  const double last = static_cast<double>(count) - 1.0;
  if (most / 2 - least / 2 <= rounding_spread * (top / 2)) return last / 2.0;
  const std::size_t below = first_not(knots_, feature, [&](double knot) { return knot < value; });
  const std::size_t after = first_not(knots_, feature, [&](double knot) { return knot <= value; });
  if (after > below) return (static_cast<double>(below) + static_cast<double>(after) - 1.0) / 2.0;
  if (below == 0) return 0.0;
  if (below == count) return last;
  return static_cast<double>(below) - 1.0 +
         share(knots_(below - 1, feature), value, knots_(below, feature));
}

double RankTable::place(std::size_t feature, double value) const {
  return (position(feature, value) + 0.5) / static_cast<double>(knots_.rows());
}

NormalScores::NormalScores(RankTable ranks)
    : ranks_(std::move(ranks)), of_knot_(ranks_.knots().rows()) {
  const std::size_t count = of_knot_.size();
  for (std::size_t k = 0; 2 * k + 1 < count; ++k) {
    of_knot_[k] = normal_quantile((static_cast<double>(k) + 0.5) / static_cast<double>(count));
    of_knot_[count - 1 - k] = -of_knot_[k];
  }
}

double NormalScores::score(std::size_t feature, double value) const {
  return value_at(of_knot_, ranks_.position(feature, value));
}

FeatureView FeatureView::fit(View view, const Matrix& rows, std::size_t components) {
  switch (view) {
    case View::plain:
      return {};
    case View::compressed:
      return FeatureView(Table(fit_scaler(rows)));
    case View::ranked:
      return FeatureView(Table(RankTable::fit(rows)));
    case View::normal_scores:
      return FeatureView(Table(NormalScores(RankTable::fit(rows))));
    case View::standardised:
      return FeatureView(Table(Standardised{fit_scaler(rows)}));
    case View::components:
      break;
  }
  Scaler scaler = fit_scaler(rows);
  PcaBasis basis = pca_basis(scaled(scaler, rows), components);
  return FeatureView(
      Table(PrincipalComponents{std::move(scaler), std::move(basis.axes), basis.explained.back()}));
}

void FeatureView::apply_to_each(std::span<double> features) const {
  if (const auto* scaler = std::get_if<Scaler>(&table_))
    for (std::size_t k = 0; k < features.size(); ++k)
      features[k] = compress(scaler->apply(k, features[k]));
  if (const auto* ranks = std::get_if<RankTable>(&table_))
    for (std::size_t k = 0; k < features.size(); ++k) features[k] = ranks->place(k, features[k]);
  if (const auto* normal = std::get_if<NormalScores>(&table_))
    for (std::size_t k = 0; k < features.size(); ++k) features[k] = normal->score(k, features[k]);
  if (const auto* own = std::get_if<Standardised>(&table_))
    for (std::size_t k = 0; k < features.size(); ++k)
      features[k] = own->scaler.apply(k, features[k]);
}

std::vector<double> FeatureView::apply(std::span<const double> features) const {
  std::vector<double> own(features.begin(), features.end());
  const auto* components = std::get_if<PrincipalComponents>(&table_);
  if (components == nullptr) {
    apply_to_each(own);
    return own;
  }
  for (std::size_t f = 0; f < own.size(); ++f) own[f] = components->scaler.apply(f, own[f]);
  std::vector<double> out(components->axes.rows(), 0.0);
  for (std::size_t k = 0; k < out.size(); ++k)
    for (std::size_t f = 0; f < own.size(); ++f) out[k] += components->axes(k, f) * own[f];
  return out;
}

Matrix FeatureView::apply(Matrix rows) const {
  if (kind() != View::components) {
    for (std::size_t r = 0; r < rows.rows(); ++r) apply_to_each(rows.row(r));
    return rows;
  }
  Matrix out(rows.rows(), width(rows.cols()));
  for (std::size_t r = 0; r < rows.rows(); ++r)
    std::ranges::copy(apply(std::span<const double>(rows.row(r))), out.row(r).begin());
  return out;
}

std::vector<std::string> FeatureView::apply(const std::vector<std::string>& names) const {
  if (kind() != View::components) return names;
  std::vector<std::string> out;
  for (std::size_t k = 1; k <= width(names.size()); ++k) out.push_back("PC" + std::to_string(k));
  return out;
}

std::size_t FeatureView::width(std::size_t features) const {
  const auto* components = std::get_if<PrincipalComponents>(&table_);
  return components == nullptr ? features : components->axes.rows();
}

Scaler fit_scaler(const Matrix& rows) {
  Scaler out{std::vector<double>(rows.cols()), std::vector<double>(rows.cols())};
  for (std::size_t k = 0; k < rows.cols(); ++k) fit_column(rows, k, out);
  return out;
}

Matrix scaled(const Scaler& scaler, const Matrix& rows) {
  Matrix out(rows.rows(), rows.cols());
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    for (std::size_t k = 0; k < rows.cols(); ++k) out(r, k) = scaler.apply(k, rows(r, k));
  }
  return out;
}

}  // namespace weft::classifier
