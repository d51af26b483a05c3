#pragma once
// The headline of `weft audit` in the report of a campaign: how much of an accuracy can be had
// without the material.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {

/// The strongest of the probes that are named; where none is, of all. Shares of right answers.
struct StrongestProbe {
  std::string name;
  double accuracy = 0.0, share = 0.0, p = 1.0;
  double full = 0.0;  ///< of the full features on the same splits
  double chance = 0.0;
  bool is_named = false;
};

/// Of one exploration.
struct AuditHeadline {
  std::string exploration;
  std::string verdict;  ///< "confounded", "no_sign" or "cannot_tell"; empty: not made
  std::string why;      ///< code of what keeps it from being told, or empty
  std::string reason;   ///< a sentence, where it cannot be told or was not made
  std::optional<StrongestProbe> probe = {};
  std::size_t permutations = 0;  ///< with LDA; none with trees
};

/// "M1: confounded. Accuracy from pad pattern alone 99.7 %, from all features 100.0 %, by chance
/// 5.6 % (SIMULATED)."
std::string format_headline(const AuditHeadline& one, BenchKind bench);

/// "confounded" where any is, else "cannot_tell" where any is, else "no_sign"; empty of none.
std::string_view overall_verdict(std::span<const AuditHeadline> all);

/// What the quick form leaves out.
std::string quick_form_note(std::span<const AuditHeadline> all);

/// {"verdict", "quick", "permutations", "explorations": {"M1": {"verdict", "why", "probe", ...}}};
/// null of none.
nlohmann::ordered_json headlines_json(std::span<const AuditHeadline> all, BenchKind bench);

}  // namespace weft::daemon
