#include "classifier/imprint/kesler.hpp"

#include <string>

namespace weft::classifier::imprint {
namespace {

std::size_t answer(const Matrix& weight, std::span<const double> row) {
  std::size_t best = 0;
  double largest = 0.0;
  for (std::size_t c = 0; c < weight.rows(); ++c) {
    double product = 0.0;
    const auto w = weight.row(c);
    for (std::size_t k = 0; k < row.size(); ++k) product += w[k] * row[k];
    if (c > 0 && product <= largest) continue;
    best = c;
    largest = product;
  }
  return best;
}

void add(std::span<double> weight, double factor, std::span<const double> row) {
  for (std::size_t k = 0; k < row.size(); ++k) weight[k] += factor * row[k];
}

std::size_t one_round(const Matrix& rows, std::span<const std::size_t> of_row, double c,
                      Matrix& weight) {
  std::size_t mistakes = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const std::size_t predicted_as = answer(weight, rows.row(r));
    if (predicted_as == of_row[r]) continue;
    add(weight.row(of_row[r]), c, rows.row(r));
    add(weight.row(predicted_as), -c, rows.row(r));
    ++mistakes;
  }
  return mistakes;
}

}  // namespace

Result<KeslerOutcome> train_kesler(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, const KeslerOptions& options) {
  if (auto ok = check_training(rows, of_row, classes); !ok) return pass(ok.error(), "perceptron");
  if (!(options.c > 0.0 && options.c <= 1e6) || options.most_rounds == 0)
    return fail(
        {.code = Errc::range,
         .where = "perceptron",
         .what = "a perceptron cannot learn with this",
         .expected = "0 < c <= 1e6, at least one round",
         .got = "c " + std::to_string(options.c) + ", " + std::to_string(options.most_rounds)});
  Scaler scaler = scaler_for(options.scaling, rows);
  const Matrix inputs = with_ones(scaled(scaler, rows));
  Matrix weight(classes, inputs.cols());
  std::size_t rounds = 0, mistakes = 1;
  while (mistakes > 0 && rounds < options.most_rounds) {
    mistakes = one_round(inputs, of_row, options.c, weight);
    ++rounds;
  }
  return KeslerOutcome{LinearRule(std::move(scaler), std::move(weight)), mistakes == 0, rounds,
                       mistakes};
}

}  // namespace weft::classifier::imprint
