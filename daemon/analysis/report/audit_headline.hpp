#pragma once
// The headline of `weft audit` in the report of a campaign: the part of an accuracy that is
// possible without the material.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {

/// The strongest of the named probes; if none is named, of all. Accuracies as shares.
struct StrongestProbe {
  std::string name;
  double accuracy = 0.0, share = 0.0, p = 1.0;
  double full = 0.0;  ///< accuracy of the full features on the same splits
  double chance = 0.0;
  bool is_named = false;
};

/// Audit result for one exploration.
struct AuditHeadline {
  std::string exploration;
  std::string verdict;  ///< "confounded", "no_sign" or "cannot_tell"; empty: no audit was made
  std::string why;      ///< code of the reason for "cannot_tell", or empty
  std::string reason;   ///< a sentence, if undecided or not made
  std::optional<StrongestProbe> probe = {};
  std::size_t permutations = 0;  ///< with LDA; 0 with trees
};

/// "M1: confounded. Accuracy from pad pattern alone 99.7 %, from all features 100.0 %, by chance
/// 5.6 % (SIMULATED)."
std::string format_headline(const AuditHeadline& one, BenchKind bench);

/// "confounded" if any is, else "cannot_tell" if any is, else "no_sign"; empty for an empty list.
std::string_view overall_verdict(std::span<const AuditHeadline> all);

/// Names the parts of the audit that the quick form omits.
std::string quick_form_note(std::span<const AuditHeadline> all);

/// {"verdict", "quick", "permutations", "explorations": {"M1": {"verdict", "why", "probe", ...}}};
/// null for an empty list.
nlohmann::ordered_json headlines_json(std::span<const AuditHeadline> all, BenchKind bench);

}  // namespace weft::daemon
