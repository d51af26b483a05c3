#include "classifier/fabric/options.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "protocols/base/names.hpp"

namespace weft::classifier {
namespace {

constexpr NameTable<Reduction, 3> reduction_names = {
    {{Reduction::pvalue, "pvalue"}, {Reduction::pca, "pca"}, {Reduction::all, "all"}}};
constexpr NameTable<Tie, 3> tie_names = {
    {{Tie::automatic, "automatic"}, {Tie::loss, "loss"}, {Tie::order, "order"}}};

Status check_list(const std::vector<double>& values, double highest, const char* name,
                  const char* expected) {
  const bool good = !values.empty() && std::all_of(values.begin(), values.end(), [&](double v) {
    return v > 0.0 && v <= highest && std::isfinite(v);
  });
  if (good) return {};
  return fail({.code = Errc::range,
               .where = name,
               .what = "grid value out of range",
               .expected = std::string(expected) + ", at least one"});
}

}  // namespace

std::string_view to_string(Reduction reduction) {
  return name_in(reduction_names, reduction);
}

Result<Reduction> reduction_from(std::string_view text) {
  return value_from(reduction_names, text, "unknown reduction", name_list(reduction_names));
}

std::string_view to_string(Tie tie) {
  return name_in(tie_names, tie);
}

Status check(const TrainOptions& options) {
  constexpr double unlimited = HUGE_VAL;
  constexpr const char* shares = "numbers in (0, 1]";
  if (auto ok = check_list(options.grid.c, Grid::most_c, "grid C", "positive numbers up to 1e12");
      !ok)
    return ok;
  if (auto ok = check_list(options.grid.gamma, unlimited, "grid gamma", "positive numbers"); !ok)
    return ok;
  if (options.reduction == Reduction::pvalue) {
    if (auto ok = check_list(options.grid.delta, 1.0, "grid delta", shares); !ok) return ok;
  }
  if (options.reduction == Reduction::pca) {
    if (auto ok = check_list(options.grid.explained, 1.0, "grid explained", shares); !ok) return ok;
  }
  if (options.cap == 0)
    return fail({.code = Errc::range,
                 .where = "cap",
                 .what = "cap out of range",
                 .expected = "at least 1",
                 .got = "0"});
  if (options.folds < 2) {
    return fail({.code = Errc::range,
                 .where = "folds",
                 .what = "too few folds",
                 .expected = "at least 2",
                 .got = std::to_string(options.folds)});
  }
  if (!(options.tolerance > 0.0 && std::isfinite(options.tolerance))) {
    return fail({.code = Errc::range,
                 .where = "tolerance",
                 .what = "tolerance out of range",
                 .expected = "above 0",
                 .got = std::to_string(options.tolerance)});
  }
  return {};
}

void note_unconverged(const TrainOptions& options) {
  if (options.unconverged) ++*options.unconverged;
}

Status unless_stopped(const std::function<bool()>& stop) {
  if (stop && stop())
    return fail(
        {.code = Errc::wrong_state, .where = "train", .what = "training stopped on request"});
  return {};
}

}  // namespace weft::classifier
