#include "classifier/learners/learner.hpp"

namespace weft::classifier {

TrainedLearner::TrainedLearner(FabricModel cores)
    : TrainedLearner(cores_with(cores.reduction()), cores.labels(), cores.feature_names(), {},
                     predictor_of(cores)) {}

Result<std::vector<double>> TrainedLearner::prepared(std::span<const double> features) const {
  if (auto ok = check_length(features, features_.size(), "classify", another_sensor); !ok)
    return pass(ok.error());
  if (auto ok = check_features(features, features_); !ok) return pass(ok.error());
  if (columns_.empty()) return view_.apply(features);
  std::vector<double> own;
  for (const std::size_t column : columns_) own.push_back(features[column]);
  return view_.apply(own);
}

FeatureMatrix TrainedLearner::prepared(FeatureMatrix matrix) const {
  if (!columns_.empty()) matrix = select_columns(matrix, columns_);
  matrix.values = view_.apply(std::move(matrix.values));
  matrix.names = view_.apply(matrix.names);
  return matrix;
}

Result<ClassScores> TrainedLearner::predict(std::span<const double> features) const {
  const auto own = prepared(features);
  if (!own) return pass(own.error());
  return predictor_->predict(*own);
}

Result<std::size_t> TrainedLearner::classify(std::span<const double> features) const {
  const auto own = prepared(features);
  if (!own) return pass(own.error());
  return predictor_->classify(*own);
}

// Every view except View::components transforms each column separately.
std::vector<std::size_t> TrainedLearner::used_columns() const {
  if (view_.kind() == View::components) return columns_;
  std::vector<std::size_t> out = predictor_->used_columns();
  if (out.empty()) return columns_;
  if (!columns_.empty())
    for (std::size_t& column : out) column = columns_[column];
  return out;
}

}  // namespace weft::classifier
