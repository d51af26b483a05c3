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
  add(Modality::fabric, "fabric", "recognise fabrics by a tactile array (Khan 2016)");
  add(Modality::vibro, "vibro", "recognise textures by sound and vibration (2023)");
  add_imprint_commands(
      add(Modality::imprint, "imprint", "simulate and evaluate static imprints (Ellis 1986)"));
}

void add_earlier_commands(const CommandGroup& weft) {
  for (const auto add_command :
       {add_features_command, add_evaluate_command, add_train_command, add_classify_command})
    add_command(weft, {})->group(
        "Commands of version 1, for any kind of data; removed in the next version");
}

}  // namespace weft::daemon::cli
