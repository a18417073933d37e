!> The group `poincare` of a results file: Poincare sections, which are the states of the motion at the instants of one
!> phase angle in each period of the load.
module section_groups
   use kinds, only: wp
   use point_groups, only: contact_points, body_points, put_motion, put_points
   use quantity_groups, only: quantity_group_t
   use section_types, only: run_sections_t
   implicit none (type, external)
   private
   public :: write_sections

contains

   !> Write the instants of the sections, the states of the motion at the sections and, if it was computed, the Lyapunov
   !> exponent.
   subroutine write_sections(group, sections, names)
      type(quantity_group_t), intent(in) :: group
      type(run_sections_t), intent(in) :: sections
      !> Names of the contacts, with blanks between them
      character(*), intent(in) :: names

      integer :: k, contacts, extra

      associate (n => sections%count)
         call group%put_attribute('period', sections%period, 'time')
         call group%attribute('motion_period', [sections%motion_period])
         call group%attribute('impacts_per_period', sections%impacts_per_period)
         call group%attribute('tolerance', sections%tolerance)
         if (allocated(sections%log_norm)) then
            call group%put_attribute('lyapunov_exponent', sections%lyapunov_exponent, 'rate')
            call group%attribute('lyapunov_exponent_per_period', sections%lyapunov_exponent*sections%period)
         end if
         call group%put('tau', sections%tau(:n), 'time', 'instant of the section{, tau}', is_scale=.true.)
         ! a section within rounding of the end of a period belongs to that period
         call group%put('load_period', ceiling(sections%tau(:n)/sections%period - 1.0e-9_wp), &
            'in which period of the load it is', 'tau')
         call group%put('impacts', sections%impacts(:n), 'impacts in the period before', 'tau')
         call group%put('displacement_tip', sections%displacement(1, 0, :n), 'displacement', &
            'displacement of the tip, up from the unstressed beam', 'tau')
         call group%put('velocity_tip', sections%displacement(2, 0, :n), 'velocity', 'its velocity', 'tau')
         if (allocated(sections%log_norm)) call group%put('log_variation', sections%log_norm(:n), 'number', &
            'logarithm of the size of a variation of the motion, no number where nothing is left of it', 'tau')
         contacts = size(sections%contact, 2)
         if (contacts > 0) then
            call put_points(group, contact_points, contacts)
            call group%attribute('flag_values', [(k, k=1, contacts)], 'surface')
            call group%attribute('flag_meanings', names, 'surface')
            call put_motion(group, contact_points, sections%contact(1, :, :n), sections%contact(2, :, :n))
         end if
         extra = ubound(sections%displacement, 2)
         if (extra > 0) then
            call put_points(group, body_points, extra)
            call put_motion(group, body_points, sections%displacement(1, 1:, :n), sections%displacement(2, 1:, :n))
         end if
         if (.not. allocated(sections%modes)) return
         call group%put('mode', [(k, k=1, size(sections%modes, 2))], 'free mode, of unit modal mass rho Abar L = 1', &
            is_scale=.true.)
         call group%put('displacement_mode', sections%modes(1, :, :n), 'displacement', 'its coordinate', 'mode tau')
         call group%put('velocity_mode', sections%modes(2, :, :n), 'velocity', 'the rate of that', 'mode tau')
      end associate
   end subroutine write_sections

end module section_groups
