#pragma once
// What every user of libsvm needs. Only for .cpp files: it brings libsvm's header with it.

#include <libsvm/svm.h>

#include <algorithm>
#include <cstddef>
#include <memory>

namespace weft::classifier {

/// libsvm reports progress through one process-wide function; silenced once, before the first
/// training, but for what libsvm_iterations() wants to know.
void silence_libsvm();

/// Of the last problem that this thread solved, as libsvm reported them.
std::size_t libsvm_iterations();
/// At so many it gives up on a problem of `rows`, and returns what it has (svm.cpp, Solver::Solve).
constexpr std::size_t libsvm_most_iterations(std::size_t rows) {
  return std::max<std::size_t>(10'000'000, 100 * rows);
}

struct FreeSvmModel {
  void operator()(svm_model* model) const { svm_free_and_destroy_model(&model); }
};
using SvmModel = std::unique_ptr<svm_model, FreeSvmModel>;

}  // namespace weft::classifier
