// The rule that decides between grid points with equally few errors, by the number of fabrics.

#include <catch2/catch.hpp>

#include "classifier/fabric/model.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::tie_test {
namespace {

using testing::gaussian_classes;

std::vector<double> chosen(const std::vector<FabricCore>& cores) {
  std::vector<double> out;
  for (const FabricCore& core : cores)
    for (const double v : {core.info().c, core.info().gamma, core.bias()}) out.push_back(v);
  return out;
}

TrainOptions with(Tie tie) {
  TrainOptions options{.reduction = Reduction::all, .tie = tie};
  options.grid.c = {0.5, 8};
  options.grid.gamma = {0x1p-3, 0x1p-1};
  options.folds = 2;
  return options;
}

TEST_CASE("Ties go by loss below a hundred fabrics and by order from there on, unless set") {
  CHECK(resolved(Tie::automatic, many_fabrics - 1) == Tie::loss);
  CHECK(resolved(Tie::automatic, many_fabrics) == Tie::order);
  CHECK(resolved(Tie::loss, 500) == Tie::loss);
  CHECK(resolved(Tie::order, 2) == Tie::order);
  CHECK(TrainOptions{}.tie == Tie::automatic);
}

TEST_CASE("A training uses the rule of its number of fabrics, all at once or in shares") {
  for (const std::size_t fabrics : {many_fabrics - 1, many_fabrics}) {
    const FeatureMatrix matrix = gaussian_classes(fabrics, 4, 7, 4.0, 3);
    const auto by_loss = chosen(train(matrix, with(Tie::loss)).value().cores());
    const auto by_order = chosen(train(matrix, with(Tie::order)).value().cores());
    REQUIRE(by_loss != by_order);
    const auto& expected = fabrics < many_fabrics ? by_loss : by_order;
    CHECK(chosen(train(matrix, with(Tie::automatic)).value().cores()) == expected);

    const auto share = chosen(train_cores(matrix, with(Tie::automatic), 1, 2).value());
    for (std::size_t i = 0; i < share.size(); ++i)
      REQUIRE(share[i] == expected[(2 * (i / 3) + 1) * 3 + i % 3]);
  }
}

}  // namespace
}  // namespace weft::classifier::tie_test
