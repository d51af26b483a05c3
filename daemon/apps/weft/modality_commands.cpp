#include "daemon/apps/weft/command_specs.hpp"
#include "daemon/apps/weft/commands.hpp"

namespace weft::daemon::cli {

void add_modality_commands(const CommandGroup& weft) {
  using classifier::Modality;
  const auto add = [&weft](Modality modality, const char* name) {
    const CommandGroup group = weft.group(name);
    for (const auto add_command :
         {add_features_command, add_evaluate_command, add_train_command, add_classify_command})
      add_command(group, modality);
    return group;
  };
  add(Modality::fabric, "fabric");
  add(Modality::vibro, "vibro");
  add_imprint_commands(add(Modality::imprint, "imprint"));
}

void add_earlier_commands(const CommandGroup& weft) {
  for (const auto add_command :
       {add_features_command, add_evaluate_command, add_train_command, add_classify_command})
    add_command(weft, {})->group(std::string(earlier_group));
}

}  // namespace weft::daemon::cli
