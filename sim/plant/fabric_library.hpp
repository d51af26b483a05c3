#pragma once
// Reads sim/fabrics.json. Every number there carries its standing: [value, "estimated"] or
// [value, "sourced", "S4"], where S4 is a key of the file's `sources`.

#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"
#include "sim/plant/fabric.hpp"

namespace weft::sim {

struct FabricLibrary {
  std::vector<Fabric> fabrics;
  MaterialParams params;
  TrialSpread spread;

  /// nullptr for a name that the table does not have.
  [[nodiscard]] const Fabric* find(std::string_view name) const;
  [[nodiscard]] std::vector<std::string> names() const;
};

/// Errors: parse (not JSON, a key missing or unknown, a number without its standing), range (a
/// value that cannot be); `where` is a JSON pointer.
Result<FabricLibrary> parse_fabrics(std::string_view json);

}  // namespace weft::sim
