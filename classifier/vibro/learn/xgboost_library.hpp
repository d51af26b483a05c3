#pragma once
// XGBoost's C interface, loaded when it is first asked for: a daemon that never learns with it need
// not hold its four megabytes. Only where Weft is built with libxgboost-dev.

#include <xgboost/c_api.h>

namespace weft::classifier::vibro {

/// Its functions by the names that they have in the library's header.
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

/// Loaded once for the life of the process; null where the system does not have it. May be called
/// by several threads.
const XgboostLibrary* xgboost_library();

}  // namespace weft::classifier::vibro
