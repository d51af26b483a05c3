#pragma once
// The result of `weft audit` as text and as JSON.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "classifier/evaluate/audit.hpp"
#include "daemon/apps/weft/audit_tables.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {

/// Accuracy of changed features, or of the full ones on other splits.
struct BesideFigure {
  std::string name;
  classifier::Reached reached;
};

struct AuditReport {
  std::filesystem::path dataset;
  std::string sha256;
  BenchKind kind = BenchKind::unknown;
  std::string banner;  ///< bench_banner()
  AuditTables tables;
  std::string split_text;
  std::size_t splits = 0;                           ///< 0: each label is one recording
  std::optional<classifier::AuditFigures> figures;  ///< nullopt without a split
  std::vector<BesideFigure> beside;
  std::vector<std::string> single_columns;  ///< mounting, piece: columns with a single value
};

/// One page: table, verdict and the data to record next. Ends with a newline.
std::string audit_text(const AuditReport& report);

nlohmann::json audit_json(const AuditReport& report);

/// Reason for a missing result, without a full stop; empty if there is a result.
std::string obstacle_text(const AuditReport& report);

}  // namespace weft::daemon::cli
