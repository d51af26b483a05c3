#include "classifier/learners/learners.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "classifier/fabric/model.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/learn/svm.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t most_vectors = 100'000'000;

// One row in the format of libsvm: index and value of every feature, then index -1.
void write_nodes(std::span<const double> features, svm_node* out) {
  for (std::size_t f = 0; f < features.size(); ++f) out[f] = {static_cast<int>(f + 1), features[f]};
  out[features.size()] = {-1, 0.0};
}

double compute_variance(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double sum = 0.0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum / n;
}

// The parameters that libsvm trained, and a libsvm model made only of them. So a trained model and
// a stored one predict with the same code.
class Svm final : public Predictor {
 public:
  // `of_class` [classes]: number of support vectors of each class; `rows` has them class by class.
  // `coefficients` [classes - 1 x vectors]; `offsets`: one per pair of classes.
  Svm(double gamma, std::vector<std::size_t> of_class, Matrix rows, Matrix coefficients,
      std::vector<double> offsets)
      : of_class_(std::move(of_class)),
        rows_(std::move(rows)),
        coefficients_(std::move(coefficients)),
        offsets_(std::move(offsets)),
        nodes_(rows_.rows() * (rows_.cols() + 1)) {
    for (std::size_t i = 0; i < rows_.rows(); ++i) {
      row_.push_back(nodes_.data() + i * (rows_.cols() + 1));
      write_nodes(rows_.row(i), row_.back());
    }
    for (std::size_t k = 0; k < coefficients_.rows(); ++k)
      coefficient_.push_back(coefficients_.row(k).data());
    for (std::size_t c = 0; c < of_class_.size(); ++c) {
      label_.push_back(static_cast<int>(c));
      count_.push_back(static_cast<int>(of_class_[c]));
    }
    model_.param.svm_type = C_SVC;
    model_.param.kernel_type = RBF;
    model_.param.gamma = gamma;
    model_.nr_class = static_cast<int>(of_class_.size());
    model_.l = static_cast<int>(row_.size());
    model_.SV = row_.data();
    model_.sv_coef = coefficient_.data();
    model_.rho = offsets_.data();
    model_.label = label_.data();
    model_.nSV = count_.data();
  }

  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override {
    std::vector<svm_node> nodes(features.size() + 1);
    write_nodes(features, nodes.data());
    std::vector<double> decision(offsets_.size());
    const double winner = svm_predict_values(&model_, nodes.data(), decision.data());
    const std::size_t classes = of_class_.size();
    ClassScores out{static_cast<std::size_t>(winner), std::vector<double>(classes),
                    std::vector<int>(classes)};
    std::size_t pair = 0;
    for (std::size_t a = 0; a < classes; ++a)
      for (std::size_t b = a + 1; b < classes; ++b, ++pair) {
        const double f = decision[pair];
        ++out.votes[f > 0.0 ? a : b];
        out.score[a] += std::tanh(f);
        out.score[b] -= std::tanh(f);
      }
    return out;
  }

  void write(LineWriter& out) const override {
    out.number("gamma", model_.param.gamma);
    out.counts("vectors", of_class_);
    write_rows(out, "vector", rows_);
    write_rows(out, "coefficients", coefficients_);
    out.numbers("offsets", offsets_);
  }

 private:
  std::vector<std::size_t> of_class_;
  Matrix rows_, coefficients_;
  std::vector<double> offsets_;
  std::vector<svm_node> nodes_;
  std::vector<svm_node*> row_;
  std::vector<double*> coefficient_;
  std::vector<int> label_, count_;
  svm_model model_{};  // points to the members above
};

// The model's support vectors are nodes with `features` features.
std::unique_ptr<Svm> taken_from(const svm_model& model, double gamma, std::size_t features) {
  const auto classes = static_cast<std::size_t>(model.nr_class);
  const auto vectors = static_cast<std::size_t>(model.l);
  Matrix rows(vectors, features), coefficients(classes - 1, vectors);
  for (std::size_t i = 0; i < vectors; ++i)
    for (std::size_t f = 0; f < features; ++f) rows(i, f) = model.SV[i][f].value;
  for (std::size_t k = 0; k + 1 < classes; ++k)
    std::copy_n(model.sv_coef[k], vectors, coefficients.row(k).begin());
  return std::make_unique<Svm>(gamma, std::vector<std::size_t>(model.nSV, model.nSV + classes),
                               std::move(rows), std::move(coefficients),
                               std::vector<double>(model.rho, model.rho + pair_count(classes)));
}

}  // namespace

// Rows are sorted by class, so libsvm's classes are in our order and the lowest one wins a tie of
// its vote.
Result<PredictorPtr> fit_svm(const TrainingSet& training, const TrainOptions& /*options*/) {
  const Matrix& rows = training.rows();
  const std::size_t width = rows.cols() + 1;
  std::vector<std::size_t> order = numbers_below(rows.rows());
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return training.of_row()[a] < training.of_row()[b];
  });
  std::vector<svm_node> nodes(rows.rows() * width);
  std::vector<svm_node*> row;
  std::vector<double> label;
  for (std::size_t i = 0; i < order.size(); ++i) {
    write_nodes(rows.row(order[i]), nodes.data() + i * width);
    row.push_back(nodes.data() + i * width);
    label.push_back(static_cast<double>(training.of_row()[order[i]]));
  }
  svm_parameter p{};
  p.svm_type = C_SVC;
  p.kernel_type = RBF;
  const double variance = compute_variance(rows.data());
  p.gamma = variance > 0.0 ? 1.0 / (static_cast<double>(rows.cols()) * variance) : 1.0;
  p.cache_size = 200.0;  // MiB
  p.eps = 1e-3;
  p.C = 1.0;
  p.shrinking = 1;
  const svm_problem problem{static_cast<int>(row.size()), label.data(), row.data()};
  silence_libsvm();
  const SvmModel model(svm_train(&problem, &p));
  return taken_from(*model, p.gamma, rows.cols());
}

PredictorPtr read_svm(LineReader& in, std::size_t features, std::size_t classes) {
  const double gamma = in.positive("gamma");
  auto of_class = in.counts("vectors", classes);
  std::size_t vectors = 0;
  for (const std::size_t count : of_class) vectors += std::min(count, most_vectors);
  if (vectors == 0 || vectors > most_vectors)
    in.refuse("number of support vectors out of range", "1 to " + std::to_string(most_vectors),
              std::to_string(vectors));
  Matrix rows = read_rows(in, "vector", vectors, features);
  Matrix coefficients = read_rows(in, "coefficients", classes - 1, vectors);
  auto offsets = in.numbers("offsets", pair_count(classes));
  if (!in.ok()) return nullptr;
  return std::make_unique<Svm>(gamma, std::move(of_class), std::move(rows), std::move(coefficients),
                               std::move(offsets));
}

}  // namespace weft::classifier
