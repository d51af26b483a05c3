#pragma once
// What makes the figures of a data set doubtful and is no error: signals that are constant,
// saturated, a clock, or too small beside their level.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/features/signal_check.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// One signal of all recordings, in their order.
struct CheckedSignal {
  std::string name;  ///< "7", "timestamp_ms"
  std::vector<classifier::SignalState> states;
  /// Of each recording, where it is known: what a limit must differ from, as a taxel that is not
  /// touched stays at its lowest value.
  std::vector<std::optional<double>> rest = {};
};

/// `signal` and `recording`: what one of them is called ("taxel", "trial"). Signals that are alike
/// in the same recordings share a sentence.
std::vector<Warning> describe_signals(std::span<const CheckedSignal> signals,
                                      std::span<const std::string> recordings,
                                      std::string_view signal, std::string_view recording);

/// Of the motion of all complete trials, of one exploration where it is given. Imprints have none.
std::vector<Warning> find_data_warnings(const Dataset& dataset, std::string_view exploration = {});

/// A line "WARNING: ..." each; of many of one kind the first few, and how many more there are.
std::string warnings_text(std::span<const Warning> warnings);
void to_json(nlohmann::json& out, const Warning& warning);

}  // namespace weft::daemon
