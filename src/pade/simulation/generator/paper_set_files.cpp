#include "pade/simulation/generator/paper_set_files.hpp"

#include <fmt/format.h>

#include "pade/simulation/generator/paper_set.hpp"
#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {

Result<std::vector<std::filesystem::path>> write_paper_set(const std::filesystem::path& folder,
                                                           std::uint64_t seed, bool quick,
                                                           SequenceOptions options,
                                                           const SetProgress& progress) {
  options.keep_finished = true;
  const auto sequences = paper_sequences(seed, quick);
  std::vector<std::filesystem::path> folders;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    const PaperSequence& sequence = sequences[i];
    const std::filesystem::path file =
        folder / "worlds" / sequence.name / (std::string(to_name(sequence.world)) + ".sdf");
    if (const Status s = write_world(generate_world(sequence.world, sequence.world_seed), file); !s)
      return s.error();
    auto world = read_sdf(file, {});
    if (!world) return world.error();
    const auto scene = Scene::build(std::move(world).value());
    if (!scene) return scene.error();
    const std::string label = fmt::format("{} ({} of {})", sequence.name, i + 1, sequences.size());
    folders.push_back(folder / sequence.name);
    const Status written =
        write_sequence(*scene, sequence.flight, folders.back(), options, [&](int done, int total) {
          if (progress) progress(label, done, total);
        });
    if (!written) return written.error();
  }
  return folders;
}

}  // namespace pade::simulation
