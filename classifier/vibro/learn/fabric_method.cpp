#include "classifier/vibro/learn/fabric_method.hpp"

#include <string>

namespace weft::classifier::vibro {
namespace {

// Names in the order of the classes: a learner's labels are sorted.
std::string name_of(std::size_t class_number) {
  const std::string digits = std::to_string(class_number);
  return std::string(8 - std::min<std::size_t>(8, digits.size()), '0') + digits;
}

class Fabric final : public Classifier {
 public:
  explicit Fabric(TrainedLearner trained) : trained_(std::move(trained)) {}
  // Rows are finite and of the right length, which is all that is refused.
  [[nodiscard]] std::size_t classify(std::span<const double> features) const override {
    return trained_.classify(features).value_or(0);
  }

 private:
  TrainedLearner trained_;
};

}  // namespace

Result<std::unique_ptr<Classifier>> fit_fabric(const Training& training, Learner learner,
                                               const MethodOptions& options) {
  FeatureMatrix matrix;
  matrix.values = *training.rows;
  for (std::size_t f = 0; f < matrix.values.cols(); ++f) matrix.names.push_back(name_of(f));
  for (std::size_t r = 0; r < matrix.values.rows(); ++r) {
    matrix.labels.push_back(name_of(training.of_row[r]));
    matrix.groups.emplace_back();
    matrix.files.push_back(name_of(r));
  }
  TrainOptions own;
  own.threads = options.threads;
  auto trained = train_recipe(matrix, {learner, own.cap}, own);
  if (!trained) return pass(trained.error());
  return std::make_unique<Fabric>(std::move(*trained));
}

}  // namespace weft::classifier::vibro
