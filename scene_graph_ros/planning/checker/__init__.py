"""The collision checker: configurations, edges and clearances of the robots of a scene."""
