#pragma once
// XGBoost through its C interface.

#include <memory>

#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// False where Weft was built without libxgboost-dev, and where the library is not installed.
bool have_xgboost();

/// XGBClassifier() of XGBoost 1.7 with n_jobs=1: 100 rounds, depth 6, rate 0.3, softprob. Splits
/// are looked for by histograms of 256 bins (`tree_method="hist"`), the library's own default
/// from 2.0 on, not by the exact search that 1.7 takes for few rows.
Result<std::unique_ptr<Classifier>> fit_xgb(const Training& training, const MethodOptions& options);
/// XGBRFClassifier() so: one round of 100 trees, rows and features of a node drawn at 0.8.
Result<std::unique_ptr<Classifier>> fit_xgbrf(const Training& training,
                                              const MethodOptions& options);

/// What the write() of either wrote, in the library's own words (JSON); null where `in` has a
/// problem, which a build without the library is.
std::unique_ptr<Classifier> read_boosted(LineReader& in, std::size_t features, std::size_t classes);

}  // namespace weft::classifier::vibro
