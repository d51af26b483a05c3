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

struct LearnerFunctions {
  Method method;
  Result<ClassifierPtr> (*fit)(const Training& training, const MethodOptions& options);
  ClassifierPtr (*read)(LineReader& in, std::size_t features, std::size_t classes);
};

template <std::size_t layers>
Result<ClassifierPtr> fit_layers(const Training& training, const MethodOptions& options) {
  constexpr std::size_t hidden_units = 100;
  return fit_network(training, std::vector<std::size_t>(layers, hidden_units), options);
}

template <Learner learner>
Result<ClassifierPtr> fit_own(const Training& training, const MethodOptions& options) {
  return fit_fabric(training, learner, options);
}

constexpr std::array<LearnerFunctions, method_names.size()> learners = {{
    {Method::nb, fit_naive_bayes, read_naive_bayes},
    {Method::knn, fit_neighbours, read_neighbours},
    {Method::tree, fit_tree, read_trees},
    {Method::forest, fit_forest, read_trees},
    {Method::svm, fit_svm, read_svm},
    {Method::logistic, fit_logistic, read_logistic},
    {Method::nn, fit_layers<1>, read_network},
    {Method::mlp2, fit_layers<2>, read_network},
    {Method::xgb, fit_xgb, read_boosted},
    {Method::xgbrf, fit_xgbrf, read_boosted},
    {Method::lda, fit_own<Learner::lda>, read_fabric},
    {Method::cores, fit_own<Learner::all>, read_fabric},
}};
static_assert(
    [] {
      for (std::size_t i = 0; i < learners.size(); ++i)
        if (learners[i].method != static_cast<Method>(i)) return false;
      return true;
    }(),
    "learners are in the order of Method");

Status check_training(const Training& training) {
  const Matrix& rows = *training.rows;
  if (rows.rows() != training.of_row.size() || rows.cols() == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "every row needs a class and a feature",
                 .expected = std::to_string(rows.rows()) + " classes",
                 .got = std::to_string(training.of_row.size())});
  if (!training.unit.empty() && training.unit.size() != rows.rows())
    return fail({.code = Errc::invalid_argument,
                 .what = "every row needs a unit, or none has one",
                 .expected = std::to_string(rows.rows()) + " units",
                 .got = std::to_string(training.unit.size())});
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
    return not_finite("row " + std::to_string(bad / rows.cols()) + ", feature " +
                          std::to_string(bad % rows.cols()),
                      "feature", values[bad]);
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
  return learners[static_cast<std::size_t>(method)].read(in, features, classes);
}

Result<std::unique_ptr<Classifier>> fit(Method method, const Training& training,
                                        const MethodOptions& options) {
  if (auto ok = check_training(training); !ok) return pass(ok.error(), to_string(method));
  return learners[static_cast<std::size_t>(method)].fit(training, options);
}

}  // namespace weft::classifier::vibro
