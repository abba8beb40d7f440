// The smallest host in C: one collision of a steel ball with a table. Writes c_click.wav.

#include <carom/carom.h>
#include <stdio.h>

int main(void) {
  carom_body table;
  carom_body_init(&table, sizeof table);  // immovable unless it gets a mass
  table.material = "wood";

  carom_body ball;
  carom_body_init(&ball, sizeof ball);  // a sphere unless told otherwise
  ball.material = "steel";
  ball.mass = 0.0374;  // kg
  ball.radius = 0.01;  // m

  carom_event landing;  // the ball's share of the collision, at 1 m/s and with restitution 0.7
  carom_event_init(&landing, sizeof landing);
  landing.time = 0.1;  // s
  landing.body = 1;
  landing.other = 0;
  landing.impulse[1] = 1.7 * 0.0374;  // N s
  landing.normal[0] = 0.0;
  landing.normal[1] = 1.0;           // from the table to the ball
  landing.approach_speed = 1.0;      // m/s
  landing.effective_mass = 0.0374;   // kg
  landing.radius = 0.01;             // m
  landing.position[1] = -0.5;        // m, below the listener, who is at the origin
  landing.body_position[1] = -0.49;  // m
  landing.body_velocity[1] = -1.0;   // m/s

  carom_sound* sound = NULL;
  const int done =
      carom_create(NULL, &sound) == CAROM_OK && carom_set_body(sound, 0, &table) == CAROM_OK &&
      carom_set_body(sound, 1, &ball) == CAROM_OK &&
      carom_record(sound, "c_click.wav") == CAROM_OK && carom_post(sound, &landing) == CAROM_OK &&
      carom_advance(sound, 0.5) == CAROM_OK && carom_finish_recording(sound) == CAROM_OK;
  puts(done ? "c_click.wav: half a second, one click" : carom_last_message());
  carom_destroy(sound);
  return done ? 0 : 1;
}
