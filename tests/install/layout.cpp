// Prints the sizes and alignments of all public types, and the samples of one click, as compiled
// with this program's flags: the lines must be the same under all flags, or a host and a library
// that were compiled differently would corrupt each other. Compiled and run by layout.sh.

#include <bit>
#include <cstdint>
#include <cstdio>
#include <vector>

#include <carom/audio/absorption.h>
#include <carom/audio/contact_state.h>
#include <carom/audio/impulse_event.h>
#include <carom/audio/limiter.h>
#include <carom/audio/listener.h>
#include <carom/audio/material.h>
#include <carom/audio/modal_model.h>
#include <carom/audio/modal_model_file.h>
#include <carom/audio/normal_map.h>
#include <carom/audio/panel_radiator.h>
#include <carom/audio/result.h>
#include <carom/audio/rigid_radiator.h>
#include <carom/audio/room.h>
#include <carom/audio/sound_body.h>
#include <carom/audio/sound_file.h>
#include <carom/audio/surface_mesh.h>
#include <carom/audio/surface_texture.h>
#include <carom/audio/synth.h>
#include <carom/audio/synth_settings.h>
#include <carom/audio/texture_coordinates.h>
#include <carom/bullet/bullet_bridge.h>
#include <carom/bullet/world_advice.h>
#include <carom/event_sound.h>
#include <carom/modal/analysis_settings.h>
#include <carom/modal/gltf_audio.h>
#include <carom/modal/mesh_analysis.h>
#include <carom/modal/mesh_check.h>
#include <carom/modal/mesh_file.h>
#include <carom/modal/model_cache.h>
#include <carom/native/motion.h>
#include <carom/native/recording.h>
#include <carom/native/recording_format.h>
#include <carom/native/restitution.h>
#include <carom/native/sphere_stepper.h>
#include <carom/native/sphere_world.h>
#include <carom/sound.h>
#include <carom/sound_output.h>
#include <carom/sound_settings.h>

#define LAYOUT(Type) std::printf(#Type " %zu %zu\n", sizeof(carom::Type), alignof(carom::Type))

namespace {

void printVocabulary() {
  LAYOUT(Error);
  LAYOUT(Material);
  LAYOUT(Medium);
  LAYOUT(Roughness);
  LAYOUT(ThermalProperties);
  LAYOUT(ImpulseEvent);
  LAYOUT(ContactState);
  LAYOUT(Listener);
  LAYOUT(ListenerPose);
  LAYOUT(SoundBody);
  LAYOUT(RigidRadiator);
  LAYOUT(RigidRecoil);
  LAYOUT(RigidRecoil::Term);
  LAYOUT(SurfaceMesh);
  LAYOUT(ModalModel);
  LAYOUT(Mode);
  LAYOUT(ModeRadiation);
  LAYOUT(ModesLeftOut);
  LAYOUT(SurfaceTexture);
  LAYOUT(TextureCoordinates);
  LAYOUT(TextureCoordinates::Patch);
}

void printSound() {
  LAYOUT(Absorption);
  LAYOUT(Surface);
  LAYOUT(ReflectionFilter);
  LAYOUT(Reflector);
  LAYOUT(Room);
  LAYOUT(RoomMeasures);
  LAYOUT(Image);
  LAYOUT(ReverbSettings);
  LAYOUT(ComparisonSettings);
  LAYOUT(SynthSettings);
  LAYOUT(ContactEnergy);
  LAYOUT(RingEnergy);
  LAYOUT(SynthCounters);
  LAYOUT(Synth);
  LAYOUT(LimiterSettings);
  LAYOUT(Limiter);
  LAYOUT(NormalMapSettings);
  LAYOUT(PanelSettings);
  LAYOUT(PanelSolution);
  LAYOUT(RadiatorCache);
  LAYOUT(SoundFileSettings);
  LAYOUT(SoundFileWriter);
  LAYOUT(VoiceBudget);
  LAYOUT(SoundSettings);
  LAYOUT(SoundStatistics);
  LAYOUT(WorldSoundSettings);
  LAYOUT(MaterialChoice);
  LAYOUT(BodySound);
  LAYOUT(UserIndex);
  LAYOUT(BodyMaterial);
  LAYOUT(HeardCollision);
  LAYOUT(SoundCollision);
  LAYOUT(SoundOutput);
  LAYOUT(EventSound);
  LAYOUT(Sound);
}

void printMechanics() {
  LAYOUT(Instant);
  LAYOUT(Motion);
  LAYOUT(SphereFriction);
  LAYOUT(Sphere);
  LAYOUT(Oscillation);
  LAYOUT(Plane);
  LAYOUT(Box);
  LAYOUT(Spring);
  LAYOUT(Rod);
  LAYOUT(ForceField);
  LAYOUT(Drag);
  LAYOUT(SphereWorld);
  LAYOUT(SphereState);
  LAYOUT(SphereStepperCounters);
  LAYOUT(SphereStepper);
  LAYOUT(RestitutionLaw);
  LAYOUT(RestitutionTable);
  LAYOUT(Recording);
  LAYOUT(Recording::Collision);
  LAYOUT(Recording::Segment);
  LAYOUT(BulletBridge);
  LAYOUT(BulletBridgeCounters);
  LAYOUT(BulletBridgeSettings);
  LAYOUT(Advice);
  LAYOUT(AdviceSettings);
  LAYOUT(Tuning);
}

void printModes() {
  LAYOUT(GridSettings);
  LAYOUT(SolidSettings);
  LAYOUT(ShellSettings);
  LAYOUT(RadiationSettings);
  LAYOUT(RadiationReport);
  LAYOUT(MeshAnalysisSettings);
  LAYOUT(MeshAnalysis);
  LAYOUT(MeshFinding);
  LAYOUT(MeshReport);
  LAYOUT(MendedMesh);
  LAYOUT(MeshImport);
  LAYOUT(LoadedMesh);
  LAYOUT(ModelCache);
  LAYOUT(GltfAcousticMaterial);
  LAYOUT(GltfAcousticSurface);
  LAYOUT(GltfMassProperties);
  LAYOUT(GltfModalModel);
  LAYOUT(GltfAudioNode);
  LAYOUT(GltfAudio);
}

/// Returns the checksum of the sound of one impact on a steel ball at a listener; 0 if a call
/// fails.
std::uint64_t clickChecksum() {
  carom::Listener ear;
  ear.name = "ear";
  ear.position = {0.5, 0.25, 0.0};
  carom::Result<carom::Synth> synth = carom::Synth::create({}, {ear});
  carom::SoundBody ball;
  ball.material = *carom::findMaterial("steel");
  ball.mass = 0.03;
  ball.radius = 0.01;
  carom::SoundBody floor;
  floor.material = *carom::findMaterial("glass");
  if (!synth || !synth->setBody(1, ball) || !synth->setBody(2, floor)) return 0;
  carom::ImpulseEvent event;
  event.time = 0.001;
  event.body = 1;
  event.other = 2;
  event.normal = {0, 1, 0};
  event.impulse = {0, 0.0625, 0};
  event.approachSpeed = 1.0;
  event.effectiveMass = 0.03;
  event.radius = 0.01;
  synth->schedule(event);
  std::vector<double> samples(960);
  double* channel = samples.data();
  synth->render<double>({&channel, 1}, samples.size());
  std::uint64_t sum = 0xcbf29ce484222325;  // FNV-1a, word by word
  bool isHeard = false;
  for (const double sample : samples) {
    sum = (sum ^ std::bit_cast<std::uint64_t>(sample)) * 0x100000001b3;
    isHeard = isHeard || sample != 0.0;
  }
  return isHeard ? sum : 0;
}

}  // namespace

int main() {
  printVocabulary();
  printSound();
  printMechanics();
  printModes();
  const std::uint64_t sum = clickChecksum();
  std::printf("click %016llx\n", static_cast<unsigned long long>(sum));
  return sum == 0 ? 1 : 0;
}
