#include "classifier/fabric/options.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace weft::classifier {
namespace {

Status check_list(const std::vector<double>& values, double highest, const char* name,
                  const char* expected) {
  const bool good = !values.empty() && std::all_of(values.begin(), values.end(), [&](double v) {
    return v > 0.0 && v <= highest && std::isfinite(v);
  });
  if (good) return {};
  return fail(Errc::range, "unusable grid", name, std::string(expected) + ", at least one");
}

}  // namespace

std::string_view to_string(Reduction reduction) {
  switch (reduction) {
    case Reduction::pvalue:
      return "pvalue";
    case Reduction::pca:
      return "pca";
    case Reduction::all:
      return "all";
  }
  return "?";
}

std::string_view to_string(Tie tie) {
  switch (tie) {
    case Tie::automatic:
      return "automatic";
    case Tie::loss:
      return "loss";
    case Tie::order:
      return "order";
  }
  return "?";
}

Result<Reduction> reduction_from(std::string_view text) {
  for (const Reduction r : {Reduction::pvalue, Reduction::pca, Reduction::all}) {
    if (text == to_string(r)) return r;
  }
  return fail(Errc::invalid_argument, "unknown reduction", {}, "pvalue, pca or all",
              std::string(text));
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
  if (options.cap == 0) return fail(Errc::range, "cap must be at least 1", "cap", ">= 1", "0");
  if (options.folds < 2) {
    return fail(Errc::range, "too few folds", "folds", ">= 2", std::to_string(options.folds));
  }
  if (!(options.tolerance > 0.0 && std::isfinite(options.tolerance))) {
    return fail(Errc::range, "unusable tolerance", "tolerance", "> 0",
                std::to_string(options.tolerance));
  }
  return {};
}

void note_unconverged(const TrainOptions& options) {
  if (options.unconverged) ++*options.unconverged;
}

Status unless_stopped(const TrainOptions& options) {
  if (options.stop && options.stop())
    return fail(Errc::wrong_state, "the training was stopped before its end", "train");
  return {};
}

}  // namespace weft::classifier
