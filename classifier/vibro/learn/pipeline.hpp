#pragma once
// Scaling, principal components and a learner, all learnt from the training rows alone.

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "classifier/learn/feature_view.hpp"
#include "classifier/selection/selection.hpp"
#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

struct PipelineOptions {
  Method method = Method::nb;
  /// Most principal components, the paper's 3; of fewer features as many as there are, which turns
  /// them. 0: none, the scaled features themselves.
  std::size_t components = 0;
  MethodOptions learner;
  /// Asked before each training; true: what is under way ends with wrong_state.
  std::function<bool()> stop = {};
};

/// Immutable; may be asked by several threads.
class Pipeline {
 public:
  /// Refuses what fit() refuses.
  static Result<Pipeline> train(const Training& training, const PipelineOptions& options);

  /// As lines of a stored model.
  void write(LineWriter& out) const;
  /// What write() wrote: the same answers. `in` keeps the first problem; nothing then.
  static std::optional<Pipeline> read(LineReader& in, Method method, std::size_t features,
                                      std::size_t classes);

  /// Class of a row. Refuses another number of features than the training had, and values that are
  /// not finite.
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const;
  /// Principal components that were taken; 0: none, the scaled features themselves.
  [[nodiscard]] std::size_t components() const { return axes_.rows(); }
  /// Share of the variance of the scaled features that the components have; 1 without any.
  [[nodiscard]] double explained() const { return explained_; }

 private:
  Pipeline() = default;
  [[nodiscard]] std::vector<double> prepared(std::span<const double> features) const;

  Scaler scaler_;
  Matrix axes_;  // [components x features]; empty: none
  double explained_ = 1.0;
  std::unique_ptr<const Classifier> classifier_;
};

}  // namespace weft::classifier::vibro
