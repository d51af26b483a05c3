#include "classifier/learn/libsvm.hpp"

#include <charconv>
#include <string_view>

namespace weft::classifier {
namespace {

thread_local std::size_t iterations = 0;

void capture_iterations(const char* text) {
  constexpr std::string_view words = "#iter = ";
  const std::string_view line(text);
  const std::size_t at = line.find(words);
  if (at != std::string_view::npos)
    std::from_chars(line.data() + at + words.size(), line.data() + line.size(), iterations);
}

}  // namespace

void silence_libsvm() {
  static const bool done = [] {
    svm_set_print_string_function(&capture_iterations);
    return true;
  }();
  static_cast<void>(done);
}

std::size_t libsvm_iterations() {
  return iterations;
}

}  // namespace weft::classifier
