#include "classifier/vibro/learn/svm_method.hpp"

#include <algorithm>
#include <numeric>

#include "classifier/learn/libsvm.hpp"

namespace weft::classifier::vibro {
namespace {

// One row as libsvm wants it: index and value of every feature, then index -1.
void write_nodes(std::span<const double> features, svm_node* out) {
  for (std::size_t f = 0; f < features.size(); ++f) out[f] = {static_cast<int>(f + 1), features[f]};
  out[features.size()] = {-1, 0.0};
}

double variance_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double sum = 0.0;
  for (const double v : values) sum += (v - mean) * (v - mean);
  return sum / n;
}

class Svm final : public Classifier {
 public:
  // Rows are given class by class, so that libsvm's classes are in our order and its vote gives
  // ties to the lowest.
  explicit Svm(const Training& training) {
    const Matrix& rows = *training.rows;
    const std::size_t width = rows.cols() + 1;
    std::vector<std::size_t> order(rows.rows());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return training.of_row[a] < training.of_row[b];
    });
    nodes_.resize(rows.rows() * width);
    for (std::size_t i = 0; i < order.size(); ++i) {
      write_nodes(rows.row(order[i]), nodes_.data() + i * width);
      row_.push_back(nodes_.data() + i * width);
      label_.push_back(static_cast<double>(training.of_row[order[i]]));
    }
    svm_parameter p{};
    p.svm_type = C_SVC;
    p.kernel_type = RBF;
    const double variance = variance_of(rows.data());
    p.gamma = variance > 0.0 ? 1.0 / (static_cast<double>(rows.cols()) * variance) : 1.0;
    p.cache_size = 200.0;  // MiB
    p.eps = 1e-3;
    p.C = 1.0;
    p.shrinking = 1;
    const svm_problem problem{static_cast<int>(row_.size()), label_.data(), row_.data()};
    silence_libsvm();
    model_.reset(svm_train(&problem, &p));
  }

  [[nodiscard]] std::size_t classify(std::span<const double> features) const override {
    std::vector<svm_node> nodes(features.size() + 1);
    write_nodes(features, nodes.data());
    return static_cast<std::size_t>(svm_predict(model_.get(), nodes.data()));
  }

 private:
  std::vector<svm_node> nodes_;  // the model's support vectors are these
  std::vector<svm_node*> row_;
  std::vector<double> label_;
  SvmModel model_;
};

}  // namespace

Result<std::unique_ptr<Classifier>> fit_svm(const Training& training) {
  return std::make_unique<Svm>(training);
}

}  // namespace weft::classifier::vibro
