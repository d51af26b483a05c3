#pragma once
// What every user of libsvm needs. Only for .cpp files: it brings libsvm's header with it.

#include <libsvm/svm.h>

#include <memory>

namespace weft::classifier {

/// libsvm reports progress through one process-wide function; silenced once, before the first
/// training.
void silence_libsvm();

struct FreeSvmModel {
  void operator()(svm_model* model) const { svm_free_and_destroy_model(&model); }
};
using SvmModel = std::unique_ptr<svm_model, FreeSvmModel>;

}  // namespace weft::classifier
