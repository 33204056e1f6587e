"""The size from which the search for a size of each effect starts."""

#: multiple of the noise that :data:`FIRST` is of
MEDIUM = 3.3
#: factor on the drawn size with which the search for it starts; it only saves time
FIRST = {
    "supply_leak": 0.5,
    "compressor_cut_in": 0.2,
    "valve_dead_zone": 0.01,
    "valve_hysteresis": 0.15,
    "valve_centre_leakage": 0.45,
    "valve_area": 0.1,
    "input_path_lag": 0.17,
    "tube_flow_restriction": 0.5,
    "leak_muscle": 0.2,
    "heat_transfer": 0.03,
    "muscle_hysteresis": 0.055,
    "muscle_creep": 0.28,
    "muscle_rate_damping": 0.21,
    "activation_pressure": 0.033,
    "mullins_softening": 0.08,
    "pam_crowding_contact": 4.0,
    "joint_coulomb_stribeck": 0.26,
    "joint_end_stop": 0.07,
    "payload_swing": 0.75,
    "payload_change": 1.8,
    "base_flexibility": 0.45,
    "pressure_lag": 0.7,
    "encoder_error": 1.0,
    "tendon_compliance": 0.012,
    "valve_null_drift": 0.24,
    "muscle_buckling": 0.53,
    "encoder_gear_lash": 0.83,
    "hose_torque": 0.46,
    "supply_gas_cooling": 4.6,
    "exhaust_back_pressure": 0.05,
    "moment_arm_error": 1.3,
    "pressure_zero_drift": 1.5,
}
