"""The digital twin: plan, JSBSim flight, sensor synthesis and the paired mirror."""
