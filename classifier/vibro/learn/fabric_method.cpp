#include "classifier/vibro/learn/learners.hpp"

#include <algorithm>
#include <string>

#include "classifier/baseline/learner_text.hpp"

namespace weft::classifier::vibro {
namespace {

// Names in the order of the classes: a learner's labels are sorted.
std::string name_of(std::size_t class_number) {
  const std::string digits = std::to_string(class_number);
  return std::string(8 - std::min<std::size_t>(8, digits.size()), '0') + digits;
}

std::vector<std::string> names_of(std::size_t count) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < count; ++k) out.push_back(name_of(k));
  return out;
}

class Fabric final : public Classifier {
 public:
  explicit Fabric(TrainedLearner trained) : trained_(std::move(trained)) {}
  // Rows are finite and of the right length, which is all that is refused.
  [[nodiscard]] std::size_t classify(std::span<const double> features) const override {
    return trained_.classify(features).value_or(0);
  }

  void write(LineWriter& out) const override {
    write_head(out, {trained_.kind(), trained_.view().kind()});
    write_learner(out, trained_);
  }

 private:
  TrainedLearner trained_;
};

}  // namespace

Result<std::unique_ptr<Classifier>> fit_fabric(const Training& training, Learner learner,
                                               const MethodOptions& options) {
  FeatureMatrix matrix;
  matrix.values = *training.rows;
  matrix.names = names_of(matrix.values.cols());
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

std::unique_ptr<Classifier> read_fabric(LineReader& in, std::size_t features, std::size_t classes) {
  const LearnerHead head = read_head(in);
  auto trained = read_learner(in, head, names_of(classes), names_of(features));
  if (!trained || !in.ok()) return nullptr;
  return std::make_unique<Fabric>(std::move(*trained));
}

}  // namespace weft::classifier::vibro
