// A host in C with mechanics of its own: a glass marble that bounces on a wooden table until it
// lies. Writes c_host.wav, two seconds.

#include <carom/carom.h>
#include <math.h>
#include <stdio.h>

enum { MARBLE = 0, TABLE = 1 };

static const double kGravity = 9.81;     // m/s^2
static const double kRadius = 0.01;      // m
static const double kMass = 0.0105;      // kg
static const double kRestitution = 0.8;  // 1, glass on wood

// The marble's lowest point, above the table.
typedef struct marble {
  double height;    // m
  double velocity;  // m/s, upwards
} marble;

static int failed(const char* what) {
  fprintf(stderr, "%s: %s\n", what, carom_last_message());
  return 1;
}

// Creates a sound with two microphones half a metre away.
static carom_status make_sound(carom_sound** sound) {
  carom_listener ears;
  carom_listener_init(&ears, sizeof ears);
  ears.format = CAROM_LISTENER_SPACED_PAIR;
  ears.position[1] = 0.3;
  ears.position[2] = 0.4;

  carom_settings settings;
  carom_settings_init(&settings, sizeof settings);
  settings.listeners = &ears;
  settings.listener_count = 1;
  settings.full_scale = 2.0;
  return carom_create(&settings, sound);
}

static carom_status describe_bodies(carom_sound* sound) {
  carom_body table;
  carom_body_init(&table, sizeof table);
  table.material = "wood";

  carom_body ball;
  carom_body_init(&ball, sizeof ball);
  ball.material = "glass";
  ball.mass = kMass;
  ball.radius = kRadius;

  const carom_status status = carom_set_body(sound, TABLE, &table);
  return status != CAROM_OK ? status : carom_set_body(sound, MARBLE, &ball);
}

// Posts the marble's share of a bounce; the table's is silent, as nothing moves it.
static carom_status post_bounce(carom_sound* sound, double time, double speed) {
  carom_event event;
  carom_event_init(&event, sizeof event);
  event.time = time;
  event.body = MARBLE;
  event.other = TABLE;
  event.impulse[1] = (1.0 + kRestitution) * kMass * speed;
  event.normal[0] = 0.0;
  event.normal[1] = 1.0;
  event.approach_speed = speed;
  event.effective_mass = kMass;
  event.radius = kRadius;
  event.body_position[1] = kRadius;
  event.body_velocity[1] = -speed;
  return carom_post(sound, &event);
}

// Time (s) from now until the marble is at height 0.
static double time_to_landing(const marble* ball) {
  const double v = ball->velocity;
  return (v + sqrt(v * v + 2.0 * kGravity * ball->height)) / kGravity;
}

static void fall(marble* ball, double seconds) {
  ball->height += (ball->velocity - 0.5 * kGravity * seconds) * seconds;
  ball->velocity -= kGravity * seconds;
}

// Moves the marble from one frame to the next; slower than 2 cm/s it stays where it is.
static carom_status step(carom_sound* sound, marble* ball, double from, double until) {
  double now = from;
  while (ball->height > 0.0 || ball->velocity > 0.02) {
    const double landing = time_to_landing(ball);
    if (now + landing >= until) {
      fall(ball, until - now);
      break;
    }
    now += landing;
    fall(ball, landing);
    const double speed = -ball->velocity;
    const carom_status status = post_bounce(sound, now, speed);
    if (status != CAROM_OK) return status;
    ball->height = 0.0;
    ball->velocity = kRestitution * speed;
  }
  return carom_advance(sound, until);
}

static carom_status play(carom_sound* sound) {
  marble ball = {0.3, 0.0};
  for (int frame = 0; frame < 120; ++frame) {
    const carom_status status = step(sound, &ball, frame / 60.0, (frame + 1) / 60.0);
    if (status != CAROM_OK) return status;
  }
  return carom_finish_recording(sound);
}

int main(void) {
  carom_sound* sound = NULL;
  if (make_sound(&sound) != CAROM_OK) return failed("carom_create");
  if (describe_bodies(sound) != CAROM_OK) return failed("carom_set_body");
  if (carom_record(sound, "c_host.wav") != CAROM_OK) return failed("carom_record");
  if (play(sound) != CAROM_OK) return failed("the simulation");

  carom_statistics statistics = {.size = sizeof statistics};
  if (carom_get_statistics(sound, &statistics) != CAROM_OK) return failed("carom_get_statistics");
  printf("c_host.wav: %d bounces\n", (int)statistics.events);
  return carom_destroy(sound) == CAROM_OK ? 0 : failed("carom_destroy");
}
