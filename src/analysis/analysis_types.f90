!> Base type of analyses, which are computed from a finished run or from a beam alone. An analysis writes a group of the
!> results file, and may print lines on the console and add measures (scalar results) to those of the run. The module
!> `analyses` lists all analyses.
module analysis_types
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use kinds, only: wp
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: analysis_t

   !> An analysis; extensions hold its results.
   type, abstract :: analysis_t
   contains
      procedure(compute_interface), deferred :: compute
      procedure(write_interface), deferred :: write
      procedure :: print => print_nothing
      procedure :: supply_measures => add_no_measures
   end type analysis_t

   abstract interface
      !> Compute what the scene requests.
      subroutine compute_interface(self, scene, model, settings, response, error)
         import :: analysis_t, beam_model_t, failure_t, response_t, run_settings_t, scene_t
         implicit none (type, external)
         class(analysis_t), intent(inout) :: self
         !> The scene, with the settings of the analysis
         type(scene_t), intent(in) :: scene
         !> The beam of the scene
         type(beam_model_t), intent(in) :: model
         !> Settings of the run of that beam
         type(run_settings_t), intent(in) :: settings
         !> Result of that run; empty if a beam alone is analysed
         type(response_t), intent(in) :: response
         !> Set if the analysis fails
         type(failure_t), allocatable, intent(out) :: error
      end subroutine compute_interface

      !> Write the results of the analysis to its group.
      subroutine write_interface(self, group)
         import :: analysis_t, quantity_group_t
         implicit none (type, external)
         class(analysis_t), intent(in) :: self
         !> Group of the results file, empty
         type(quantity_group_t), intent(in) :: group
      end subroutine write_interface
   end interface

contains

   !> Print nothing; an analysis with output on the console overrides this procedure.
   subroutine print_nothing(self, unit, units)
      class(analysis_t), intent(in) :: self
      integer, intent(in) :: unit
      !> Units of the printed values
      type(units_t), intent(in) :: units

      associate (unused_1 => self, unused_2 => unit, unused_3 => units)
      end associate
   end subroutine print_nothing

   !> Add no measures; an analysis with measures overrides this procedure.
   subroutine add_no_measures(self, measures)
      class(analysis_t), intent(in) :: self
      !> Dimensionless measures (scalar results of the run), [measure_count]
      real(wp), intent(inout) :: measures(:)

      associate (unused_1 => self, unused_2 => measures)
      end associate
   end subroutine add_no_measures

end module analysis_types
