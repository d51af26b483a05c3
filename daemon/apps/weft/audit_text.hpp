#pragma once
// What `weft audit` found, for people and for programs.

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

/// What changed features, or the full ones on other splits, reach.
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
  std::optional<classifier::AuditFigures> figures;  ///< nothing without a split
  std::vector<BesideFigure> beside;
  std::vector<std::string> single_columns;  ///< mounting, piece: of which there is but one
};

/// One page: table, verdict, what to record next. Ends with a newline.
std::string audit_text(const AuditReport& report);

nlohmann::json audit_json(const AuditReport& report);

/// Why nothing can be told, without a full stop; empty where it can.
std::string obstacle_text(const AuditReport& report);

}  // namespace weft::daemon::cli
