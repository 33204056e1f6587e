// A board for `pamrs campaign RIG --device /dev/ttyACM0`: Arduino or ESP32, one valve, three sensors.
//
// Lines of text, each with the exclusive or of its bytes behind a star, as
// python/pamrs/campaigns/serial.py describes. Change the part "Your rig", and nothing else.

// ---------------------------------------------------------------- Your rig

const char* HELLO = "pamrs valve_command > time muscle_pressure supply_pressure joint_angle";
const int COMMANDS = 1;
const float SAFE[COMMANDS] = {5.0};     // [V] the valve closed
const float LOWEST[COMMANDS] = {0.0};   // [V] what is refused below
const float HIGHEST[COMMANDS] = {10.0}; // [V] and above
const unsigned long WATCHDOG = 500;     // [ms] without a line, after which the safe command is written

const int VALVE = 9, MUSCLE = A0, SUPPLY = A1, ANGLE = A2;

void drive(const float* value) {  // 0 to 10 V by a filtered PWM and an amplifier of two
  analogWrite(VALVE, (int)(value[0] * 25.5 + 0.5));
}

float gauge(int pin) {  // [Pa] of a transducer of 0.5 to 4.5 V for 0 to 14 bar, 10-bit converter
  return (analogRead(pin) * (5.0 / 1023.0) - 0.5) * (14.0e5 / 4.0);
}

String now();

void tell(String& line) {  // the channels of HELLO in their order, SI units
  line += now();
  line += ' '; line += String(gauge(MUSCLE), 1);
  line += ' '; line += String(gauge(SUPPLY), 1);
  line += ' '; line += String(analogRead(ANGLE) * (5.235988 / 1023.0), 6);  // [rad] of 300 deg
}

// ---------------------------------------------------------------- The protocol

String line;
unsigned long heard;

String now() {  // [s] since the start; micros() begins again every 71.6 min, a float has 7 digits
  static unsigned long wraps = 0, before = 0;
  unsigned long us = micros();
  if (us < before) wraps++;
  before = us;
  uint64_t all = ((uint64_t)wraps << 32) | us;
  char text[20];
  snprintf(text, sizeof text, "%lu.%06lu", (unsigned long)(all / 1000000), (unsigned long)(all % 1000000));
  return text;
}

byte sum(const String& text) {
  byte found = 0;
  for (unsigned int i = 0; i < text.length(); i++) found ^= (byte)text[i];
  return found;
}

void answer(const String& text) {
  char tail[6];
  snprintf(tail, sizeof tail, " *%02X", sum(text));
  Serial.print(text + tail + "\n");
}

String refusal(const String& words, float* value) {  // why a command is refused; empty: it is not
  int at = 0;
  for (int k = 0; k < COMMANDS; k++) {
    while (at < (int)words.length() && words[at] == ' ') at++;
    int end = words.indexOf(' ', at);
    if (end < 0) end = words.length();
    if (end == at) return "too few commands";
    value[k] = words.substring(at, end).toFloat();
    if (!(value[k] >= LOWEST[k] && value[k] <= HIGHEST[k])) return "beyond the limits of the board";
    at = end;
  }
  return "";
}

void handle(const String& whole) {
  int star = whole.lastIndexOf(" *");
  if (star < 0) return;
  String words = whole.substring(0, star);
  if ((byte)strtol(whole.c_str() + star + 2, NULL, 16) != sum(words)) return;
  int gap = words.indexOf(' ');
  if (gap < 0 || gap + 1 >= (int)words.length()) return;
  heard = millis();
  String out = words.substring(0, gap + 1);  // the number of the question
  char what = words[gap + 1];
  if (what == '?') out += HELLO;
  else if (what == 'R') tell(out);
  else if (what == 'W') {
    float value[COMMANDS];
    String why = refusal(words.substring(gap + 2), value);
    if (why.length() == 0) { drive(value); out += "OK"; }
    else out += "E " + why;
  } else out += "E unknown question";
  answer(out);
}

void setup() {
  pinMode(VALVE, OUTPUT);
  drive(SAFE);
  Serial.begin(115200);
  heard = millis();
}

void loop() {
  now();  // sees every wrap, asked or not
  if (millis() - heard > WATCHDOG) { drive(SAFE); heard = millis(); }
  while (Serial.available()) {
    char c = (char)Serial.read();
    if (c == '\n') { handle(line); line = ""; }
    else if (c != '\r' && line.length() < 120) line += c;
  }
}
