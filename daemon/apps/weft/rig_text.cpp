#include "daemon/apps/weft/rig_text.hpp"

namespace weft::daemon::cli {

using recipes::Cleanup;
using recipes::RigFact;

std::string format_rig(Cleanup cleanup, RigFact rig) {
  const std::string cleanup_text =
      "; look at the bench before anything moves, and lift the probe by hand if a stage is dead: "
      "the next run homes z, upwards, before all else";
  // What is done finally begins only where the probe is up.
  if (cleanup == Cleanup::partial)
    return rig == RigFact::safe
               ? "the probe is up, but what the recipe does finally was not done to its end"
               : "the probe was up, but what the recipe does finally failed: where the stages "
                 "stand "
                 "is not known; look at the bench before anything moves";
  if (rig == RigFact::safe) return {};
  if (rig == RigFact::holding)
    return "the probe was not lifted: the stages stand where they were, and it may bear on the "
           "cloth" +
           cleanup_text;
  return "the probe was not lifted, as far as is known: the rig is " +
         std::string(recipes::to_string(rig)) + ", and the probe may still bear on the cloth" +
         cleanup_text;
}

}  // namespace weft::daemon::cli
