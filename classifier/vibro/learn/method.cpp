#include "classifier/vibro/learn/method.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "classifier/features/feature_stream.hpp"
#include "classifier/vibro/learn/learners.hpp"
#include "protocols/base/names.hpp"

namespace weft::classifier::vibro {
namespace {

constexpr NameTable<Method, 12> method_names = {{
    {Method::nb, "NB"},
    {Method::knn, "kNN"},
    {Method::tree, "Tree"},
    {Method::forest, "RForest"},
    {Method::svm, "SVM"},
    {Method::logistic, "LG"},
    {Method::nn, "NN"},
    {Method::mlp2, "MLP2"},
    {Method::xgb, "XGB"},
    {Method::xgbrf, "XGBRF"},
    {Method::lda, "LDA"},
    {Method::cores, "Cores"},
}};

constexpr std::size_t hidden_units = 100;

Status check_training(const Training& training) {
  const Matrix& rows = *training.rows;
  if (rows.rows() != training.of_row.size() || rows.cols() == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "every row needs a class and a feature",
                 .expected = std::to_string(rows.rows()) + " classes",
                 .got = std::to_string(training.of_row.size())});
  std::vector<bool> seen(training.classes, false);
  for (const std::size_t c : training.of_row) {
    if (c >= training.classes)
      return fail({.code = Errc::invalid_argument,
                   .what = "a class that does not exist",
                   .expected = "below " + std::to_string(training.classes),
                   .got = std::to_string(c)});
    seen[c] = true;
  }
  if (training.classes < 2 || std::find(seen.begin(), seen.end(), false) != seen.end())
    return fail(
        {.code = Errc::invalid_argument, .what = "two classes are the least, each with a row"});
  const std::span<const double> values(rows.data());
  if (const std::size_t bad = first_not_finite(values); bad < values.size())
    return fail({.code = Errc::invalid_argument,
                 .where = "row " + std::to_string(bad / rows.cols()) + ", feature " +
                          std::to_string(bad % rows.cols()),
                 .what = "feature is not finite",
                 .expected = "a finite number",
                 .got = std::to_string(values[bad])});
  return {};
}

}  // namespace

std::string_view to_string(Method method) {
  return name_in(method_names, method);
}

Result<Method> method_from(std::string_view text) {
  return value_from(method_names, text, "unknown learner", name_list(method_names));
}

std::vector<Method> all_methods() {
  return values_of(method_names);
}

std::span<const Method> quick_methods() {
  static constexpr std::array quick = {Method::lda, Method::logistic, Method::svm,
                                       Method::knn, Method::nb,       Method::forest};
  return quick;
}

bool available(Method method) {
  return (method != Method::xgb && method != Method::xgbrf) || have_xgboost();
}

std::unique_ptr<Classifier> read_classifier(Method method, LineReader& in, std::size_t features,
                                            std::size_t classes) {
  switch (method) {
    case Method::nb:
      return read_naive_bayes(in, features, classes);
    case Method::knn:
      return read_neighbours(in, features, classes);
    case Method::logistic:
      return read_logistic(in, features, classes);
    case Method::nn:
    case Method::mlp2:
      return read_network(in, features, classes);
    case Method::lda:
    case Method::cores:
      return read_fabric(in, features, classes);
    case Method::tree:
    case Method::forest:
      return read_trees(in, features, classes);
    case Method::svm:
      return read_svm(in, features, classes);
    case Method::xgb:
    case Method::xgbrf:
      return read_boosted(in, features, classes);
  }
  return nullptr;
}

Result<std::unique_ptr<Classifier>> fit(Method method, const Training& training,
                                        const MethodOptions& options) {
  if (auto ok = check_training(training); !ok) return pass(ok.error(), to_string(method));
  switch (method) {
    case Method::nb:
      return fit_naive_bayes(training);
    case Method::knn:
      return fit_neighbours(training);
    case Method::tree:
      return fit_tree(training, options);
    case Method::forest:
      return fit_forest(training, options);
    case Method::svm:
      return fit_svm(training);
    case Method::logistic:
      return fit_logistic(training);
    case Method::nn:
      return fit_network(training, {hidden_units}, options);
    case Method::mlp2:
      return fit_network(training, {hidden_units, hidden_units}, options);
    case Method::xgb:
      return fit_xgb(training, options);
    case Method::xgbrf:
      return fit_xgbrf(training, options);
    case Method::lda:
      return fit_fabric(training, Learner::lda, options);
    case Method::cores:
      return fit_fabric(training, Learner::all, options);
  }
  return fail({.code = Errc::invalid_argument, .what = "unknown learner"});
}

}  // namespace weft::classifier::vibro
