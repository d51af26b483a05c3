#include "classifier/learners/learners.hpp"

#include <string>

#ifdef WEFT_XGBOOST_LIBRARY
#include <dlfcn.h>
#include <xgboost/c_api.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#endif

namespace weft::classifier {
namespace {

tl::unexpected<Error> not_there() {
  return fail({.code = Errc::unsupported,
               .what = "XGBoost not available",
               .hint = "Install libxgboost-dev; rebuild Weft if it was built without it"});
}

}  // namespace

#ifdef WEFT_XGBOOST_LIBRARY
namespace {

// XGBoost's C interface, loaded on first use: a daemon that never trains with it does not need its
// four megabytes.

// Functions of the library by the names in its header.
struct XgboostLibrary {
  decltype(&::XGBGetLastError) last_error = nullptr;
  decltype(&::XGDMatrixCreateFromMat) matrix_from_mat = nullptr;
  decltype(&::XGDMatrixSetFloatInfo) matrix_set_float_info = nullptr;
  decltype(&::XGDMatrixFree) matrix_free = nullptr;
  decltype(&::XGBoosterCreate) create = nullptr;
  decltype(&::XGBoosterFree) free = nullptr;
  decltype(&::XGBoosterSetParam) set_parameter = nullptr;
  decltype(&::XGBoosterUpdateOneIter) update = nullptr;
  decltype(&::XGBoosterPredictFromDense) predict = nullptr;
  decltype(&::XGBoosterSaveModelToBuffer) save = nullptr;
  decltype(&::XGBoosterLoadModelFromBuffer) load = nullptr;
};

template <class Function>
bool find(void* library, const char* name, Function& out) {
  out = reinterpret_cast<Function>(::dlsym(library, name));
  return out != nullptr;
}

// The library is never unloaded: threads of OpenMP live in it.
std::optional<XgboostLibrary> loaded() {
  constexpr int how = RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE;
  void* library = ::dlopen(WEFT_XGBOOST_LIBRARY, how);
  if (library == nullptr) library = ::dlopen(WEFT_XGBOOST_BUILT_WITH, how);
  if (library == nullptr) return std::nullopt;
  XgboostLibrary out;
  const bool whole = find(library, "XGBGetLastError", out.last_error) &&
                     find(library, "XGDMatrixCreateFromMat", out.matrix_from_mat) &&
                     find(library, "XGDMatrixSetFloatInfo", out.matrix_set_float_info) &&
                     find(library, "XGDMatrixFree", out.matrix_free) &&
                     find(library, "XGBoosterCreate", out.create) &&
                     find(library, "XGBoosterFree", out.free) &&
                     find(library, "XGBoosterSetParam", out.set_parameter) &&
                     find(library, "XGBoosterUpdateOneIter", out.update) &&
                     find(library, "XGBoosterPredictFromDense", out.predict) &&
                     find(library, "XGBoosterSaveModelToBuffer", out.save) &&
                     find(library, "XGBoosterLoadModelFromBuffer", out.load);
  return whole ? std::optional(out) : std::nullopt;
}

// Loaded once for the life of the process; null if the system does not have it. Thread: any.
const XgboostLibrary* xgboost_library() {
  static const std::optional<XgboostLibrary> library = loaded();
  return library ? &*library : nullptr;
}

// The loaded library; only called after a check that it is available.
const XgboostLibrary& xgboost() {
  return *xgboost_library();
}

// Turns the return code of a library call into a Status.
Status done(int code) {
  if (code == 0) return {};
  return fail({.code = Errc::invalid_argument, .where = "XGBoost", .what = xgboost().last_error()});
}

struct FreeMatrix {
  void operator()(void* handle) const { xgboost().matrix_free(handle); }
};
struct FreeBooster {
  void operator()(void* handle) const { xgboost().free(handle); }
};
using MatrixHandle = std::unique_ptr<void, FreeMatrix>;
using BoosterHandleOwner = std::unique_ptr<void, FreeBooster>;

std::vector<float> as_floats(std::span<const double> values) {
  std::vector<float> out;
  out.reserve(values.size());
  for (const double v : values) out.push_back(static_cast<float>(v));
  return out;
}

Result<MatrixHandle> matrix_of(const TrainingSet& training) {
  const auto values = as_floats(training.rows().data());
  DMatrixHandle handle = nullptr;
  if (auto ok = done(xgboost().matrix_from_mat(values.data(), training.rows().rows(),
                                               training.rows().cols(),
                                               std::numeric_limits<float>::quiet_NaN(), &handle));
      !ok)
    return pass(ok.error());
  MatrixHandle out(handle);
  std::vector<float> label;
  for (const std::size_t c : training.of_row()) label.push_back(static_cast<float>(c));
  if (auto ok = done(xgboost().matrix_set_float_info(handle, "label", label.data(), label.size()));
      !ok)
    return pass(ok.error());
  return out;
}

class Boosted final : public Predictor {
 public:
  explicit Boosted(BoosterHandleOwner booster) : booster_(std::move(booster)) {}

  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override {
    constexpr double least = 1e-30;  // least share; the library's shares have single precision
    const std::span<const float> share = shares(features);
    std::vector<double> score;
    for (const float p : share) score.push_back(std::log(std::max(static_cast<double>(p), least)));
    if (!score.empty()) return ClassScores{place_of_largest(share), std::move(score)};
    return fail({.code = Errc::range, .where = "XGBoost", .what = xgboost().last_error()});
  }

  void write(LineWriter& out) const override {
    bst_ulong size = 0;
    const char* text = nullptr;
    if (xgboost().save(booster_.get(), R"({"format":"json"})", &size, &text) == 0)
      out.text("booster", {text, size});
  }

  // Share of each class; empty if the library refuses.
  [[nodiscard]] std::span<const float> shares(std::span<const double> features) const {
    const auto values = as_floats(features);
    const std::string array = R"({"data":[)" +
                              std::to_string(reinterpret_cast<std::uintptr_t>(values.data())) +
                              R"(,true],"shape":[1,)" + std::to_string(values.size()) +
                              R"(],"typestr":"<f4","version":3})";
    constexpr const char* config =
        R"({"type":0,"training":false,"iteration_begin":0,"iteration_end":0,"strict_shape":false,)"
        R"("missing":NaN,"cache_id":0})";
    const bst_ulong* shape = nullptr;
    bst_ulong dimensions = 0;
    const float* share = nullptr;
    if (xgboost().predict(booster_.get(), array.c_str(), config, nullptr, &shape, &dimensions,
                          &share) != 0)
      return {};
    return {share, dimensions == 2 ? shape[1] : 0};
  }

 private:
  BoosterHandleOwner booster_;
};

using Parameters = std::vector<std::pair<const char*, std::string>>;

Result<PredictorPtr> boost(const TrainingSet& training, Parameters parameters, int rounds,
                           const TrainOptions& options) {
  if (!have_xgboost()) return not_there();
  auto matrix = matrix_of(training);
  if (!matrix) return pass(matrix.error());
  DMatrixHandle handles[] = {matrix->get()};
  BoosterHandle handle = nullptr;
  if (auto ok = done(xgboost().create(handles, 1, &handle)); !ok) return pass(ok.error());
  BoosterHandleOwner booster(handle);
  parameters.insert(parameters.end(), {{"objective", "multi:softprob"},
                                       {"num_class", std::to_string(training.classes())},
                                       {"nthread", "1"},
                                       {"verbosity", "0"},
                                       {"tree_method", "hist"},
                                       {"seed", std::to_string(options.seed % 2147483647U)}});
  for (const auto& [name, value] : parameters)
    if (auto ok = done(xgboost().set_parameter(handle, name, value.c_str())); !ok)
      return pass(ok.error());
  for (int i = 0; i < rounds; ++i) {
    if (auto ok = unless_stopped(options.stop); !ok) return pass(ok.error());
    if (auto ok = done(xgboost().update(handle, i, matrix->get())); !ok) return pass(ok.error());
  }
  return std::make_unique<Boosted>(std::move(booster));
}

}  // namespace

bool have_xgboost() {
  return xgboost_library() != nullptr;
}

Result<PredictorPtr> fit_xgb(const TrainingSet& training, const TrainOptions& options) {
  return boost(training, {}, 100, options);
}

Result<PredictorPtr> fit_xgbrf(const TrainingSet& training, const TrainOptions& options) {
  return boost(training,
               {{"num_parallel_tree", std::to_string(trees_of_forest)},
                {"learning_rate", "1"},
                {"subsample", "0.8"},
                {"colsample_bynode", "0.8"},
                {"reg_lambda", "1e-5"}},
               1, options);
}

PredictorPtr read_boosted(LineReader& in, std::size_t features, std::size_t classes) {
  const std::string text = in.text("booster");
  if (!have_xgboost()) in.refuse(not_there().value().what + ", needed by this model");
  const auto checked = checked_booster(text, features, classes);
  if (!checked) in.refuse(checked.error().what, checked.error().expected, checked.error().got);
  BoosterHandle handle = nullptr;
  if (!in.ok() || xgboost().create(nullptr, 0, &handle) != 0) return nullptr;
  BoosterHandleOwner booster(handle);
  Status ok = done(xgboost().set_parameter(handle, "verbosity", "0"));
  if (ok) ok = done(xgboost().load(handle, checked->data(), checked->size()));
  if (ok) ok = done(xgboost().set_parameter(handle, "nthread", "1"));
  auto out = std::make_unique<Boosted>(std::move(booster));
  const std::size_t feature_count = ok ? out->shares(std::vector<double>(features, 0.0)).size() : 0;
  if (feature_count != classes)
    in.refuse("booster does not match the model's features and labels",
              std::to_string(features) + " features, " + std::to_string(classes) + " labels",
              ok ? std::to_string(feature_count) + " labels" : ok.error().what.substr(0, 200));
  if (!in.ok()) return nullptr;
  return out;
}

#else

bool have_xgboost() {
  return false;
}

Result<PredictorPtr> fit_xgb(const TrainingSet& /*training*/, const TrainOptions& /*options*/) {
  return not_there();
}

Result<PredictorPtr> fit_xgbrf(const TrainingSet& /*training*/, const TrainOptions& /*options*/) {
  return not_there();
}

PredictorPtr read_boosted(LineReader& in, std::size_t /*features*/, std::size_t /*classes*/) {
  in.text("booster");
  in.refuse(not_there().value().what + ", needed by this model");
  return nullptr;
}

#endif

}  // namespace weft::classifier
