#ifdef WEFT_XGBOOST_LIBRARY
#include "classifier/vibro/learn/xgboost_library.hpp"

#include <dlfcn.h>

#include <optional>

namespace weft::classifier::vibro {
namespace {

template <class Function>
bool find(void* library, const char* name, Function& out) {
  out = reinterpret_cast<Function>(::dlsym(library, name));
  return out != nullptr;
}

// It is never unloaded: threads of OpenMP live in it.
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

}  // namespace

const XgboostLibrary* xgboost_library() {
  static const std::optional<XgboostLibrary> library = loaded();
  return library ? &*library : nullptr;
}

}  // namespace weft::classifier::vibro
#endif
