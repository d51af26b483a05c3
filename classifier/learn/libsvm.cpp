#include "classifier/learn/libsvm.hpp"

namespace weft::classifier {
namespace {

void print_nothing(const char* /*text*/) {}

}  // namespace

void silence_libsvm() {
  static const bool done = [] {
    svm_set_print_string_function(&print_nothing);
    return true;
  }();
  static_cast<void>(done);
}

}  // namespace weft::classifier
