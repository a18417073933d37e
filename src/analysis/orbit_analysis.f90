!> Analysis of periodic motions under periodic loads and of their branches over a load parameter: the search, a group of
!> the results file, and lines on the console.
module orbit_analysis
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use analysis_types, only: analysis_t
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use kinds, only: wp
   use number_text, only: rounded, to_text
   use orbit_search, only: find_orbits
   use orbit_types, only: mark_doubling, mark_fold, mark_grazing, mark_limit, mark_lost, mark_names, mark_words, &
      mark_torus, orbit_branch_t, orbit_point_t, orbit_study_t
   use point_groups, only: contact_points, put_motion, put_points
   use printable_text, only: joined
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use reader_units, only: with_decimals, phrase, value_in_units
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: scene_t
   use table_columns, only: print_line
   implicit none (type, external)
   private
   public :: orbit_analysis_t

   !> Maximum number of Floquet multipliers on the console.
   integer, parameter :: max_shown = 4
   !> Decimals of multipliers, times and parameters on the console.
   integer, parameter :: decimals = 8

   !> The analysis &orbit, with its result.
   type, extends(analysis_t) :: orbit_analysis_t
      type(orbit_study_t), allocatable :: study
   contains
      procedure :: compute
      procedure :: write => write_orbits
      procedure :: print => print_orbits
   end type orbit_analysis_t

contains

   !> Find the periodic motion that the run approaches, and the branches of such motions.
   subroutine compute(self, scene, model, settings, response, error)
      class(orbit_analysis_t), intent(inout) :: self
      !> The scene, with the group &orbit
      type(scene_t), intent(in) :: scene
      !> The beam of the scene
      type(beam_model_t), intent(in) :: model
      !> Settings of the run of that beam
      type(run_settings_t), intent(in) :: settings
      !> Not used, because the search makes its own runs
      type(response_t), intent(in) :: response
      !> Set if no periodic motion is found
      type(failure_t), allocatable, intent(out) :: error

      associate (unused => response)
         call find_orbits(model, settings, scene%orbit, self%study, error)
      end associate
   end subroutine compute

   !> Write the group of the results file, with a subgroup for each branch.
   subroutine write_orbits(self, group)
      class(orbit_analysis_t), intent(in) :: self
      type(quantity_group_t), intent(in) :: group

      integer :: k

      associate (study => self%study, orbit => self%study%orbit)
         call group%put_attribute('period', orbit%period, 'time')
         call group%attribute('periods', [orbit%periods])
         call group%attribute('impacts', [orbit%impacts])
         call group%attribute('is_stable', [merge(1, 0, orbit%is_stable())])
         call group%attribute('residual', orbit%residual)
         call group%attribute('steps', [orbit%iterations])
         call group%put_attribute('least_impact_speed', speed_of(orbit), 'velocity')
         call group%put('multiplier', [(k, k=1, size(orbit%multiplier))], 'Floquet multiplier, the largest first', &
            is_scale=.true.)
         call group%put('multiplier_real', real(orbit%multiplier, wp), 'number', 'real part', 'multiplier')
         call group%put('multiplier_imaginary', aimag(orbit%multiplier), 'number', 'imaginary part', 'multiplier')
         call group%put('tau', study%tau, 'time', 'time after phase 0 of the loads{, tau}', is_scale=.true.)
         call group%put('displacement_tip', study%tip, 'displacement', &
            'displacement of the tip, up from the unstressed beam', 'tau')
         call group%put('velocity_tip', study%tip_velocity, 'velocity', 'its velocity', 'tau')
         if (size(study%stop, 1) > 0) then
            call put_points(group, contact_points, size(study%stop, 1))
            call put_motion(group, contact_points, study%stop, study%stop_velocity)
         end if
         if (.not. allocated(study%branch)) return
         call group%attribute('branches', [size(study%branch)])
         do k = 1, size(study%branch)
            call write_branch(group%subgroup('branch_'//to_text(k)), study%branch(k), trim(study%quantity))
         end do
      end associate
   end subroutine write_orbits

   !> Minimum impact speed of a periodic motion; NaN if it has no impact with restitution.
   elemental real(wp) function speed_of(point) result(speed)
      type(orbit_point_t), intent(in) :: point

      speed = ieee_value(1.0_wp, ieee_quiet_nan)
      if (point%min_speed < huge(1.0_wp)) speed = point%min_speed
   end function speed_of

   !> Write one branch: its points, and displacement and velocity of the tip at the sections of each point.
   subroutine write_branch(group, branch, quantity)
      type(quantity_group_t), intent(in) :: group
      type(orbit_branch_t), intent(in) :: branch
      !> Quantity of the branch parameter, as in `quantity_table`
      character(*), intent(in) :: quantity

      character(*), parameter :: along = 'section point'
      complex(wp) :: largest(size(branch%point))
      real(wp), dimension(maxval(branch%point%periods), size(branch%point)) :: displacement, velocity
      integer :: i, k

      associate (point => branch%point)
         call group%attribute('parent', [branch%parent])
         call group%attribute('parent_point', [branch%parent_point])
         call group%attribute('begins_where', end_in_words(branch, 1))
         call group%attribute('ends_where', end_in_words(branch, size(branch%point)))
         do i = 1, size(point)
            largest(i) = point(i)%multiplier(1)
            do k = 1, size(displacement, 1)
               ! a motion of fewer periods than the longest one is repeated
               displacement(k, i) = point(i)%tip(1, 1 + modulo(k - 1, point(i)%periods))
               velocity(k, i) = point(i)%tip(2, 1 + modulo(k - 1, point(i)%periods))
            end do
         end do
         call group%put('point', [(i, i=1, size(point))], 'place along the branch', is_scale=.true.)
         call group%put('section', [(k, k=1, size(displacement, 1))], 'section of phase 0', is_scale=.true.)
         call group%put('parameter', point%value, quantity, 'amplitude or frequency of the load', 'point')
         call group%put('period', point%period, 'time', 'of the loads', 'point')
         call group%put('periods', point%periods, 'periods of the loads after which the motion returns', 'point')
         call group%put('impacts', point%impacts, 'impacts and contacts until it returns', 'point')
         call group%put('is_stable', merge(1, 0, point%is_stable()), '1: motions beside it come to it', 'point')
         call group%put('mark', point%mark, 'what happens there', 'point')
         call group%put_flags('mark', joined(mark_names, ' '), first=0)
         call group%put('multiplier_real', real(largest, wp), 'number', 'largest multiplier, real part', 'point')
         call group%put('multiplier_imaginary', aimag(largest), 'number', 'imaginary part', 'point')
         call group%put('least_impact_speed', speed_of(point), 'velocity', &
            'minimum speed of an impact with restitution', 'point')
         call group%put('displacement_tip', displacement, 'displacement', &
            'displacement of the tip at sections, up from the unstressed beam', along)
         call group%put('velocity_tip', velocity, 'velocity', 'its velocity', along)
      end associate
   end subroutine write_branch

   !> Print the periodic motion with its Floquet multipliers, and ends and bifurcations of each branch.
   subroutine print_orbits(self, unit, units)
      class(orbit_analysis_t), intent(in) :: self
      integer, intent(in) :: unit
      !> Units of the printed values
      type(units_t), intent(in) :: units

      character(:), allocatable :: words
      integer :: i, k

      associate (orbit => self%study%orbit)
         write (unit, '()')
         call print_line(unit, '', trim(merge('periodic motion, stable  ', 'periodic motion, unstable', &
            orbit%is_stable()))//', of '//counted(orbit%periods, 'load period') &
            //phrase(units, ' of {tau~t} = ', 'time', orbit%period, decimals)//', with ' &
            //counted(orbit%impacts, 'impact'), width=0)
         write (unit, '(2x, a)') 'returns to '//rounded(orbit%residual)//' of its size after '// &
            counted(orbit%iterations, 'step')//" of Newton's method"
         do i = 1, min(max_shown, size(orbit%multiplier))
            write (unit, '(2x, a)') 'multiplier '//to_text(i)//'   '//multiplier_in_words(orbit%multiplier(i))
         end do
      end associate
      if (.not. allocated(self%study%branch)) return
      do k = 1, size(self%study%branch)
         associate (branch => self%study%branch(k))
            words = 'branch '//to_text(k)//', '//counted(maxval(branch%point%periods), 'load period')
            if (branch%parent > 0) words = words//', leaves branch '//to_text(branch%parent)
            write (unit, '(/, 2x, a)') words
            write (unit, '(4x, a)') counted(size(branch%point), 'point')//' from '//value_of(branch%point(1))//' to ' &
               //value_of(branch%point(size(branch%point)))
            if (branch%parent == 0) write (unit, '(4x, a)') 'begins where '//end_in_words(branch, 1)
            write (unit, '(4x, a)') 'ends where '//end_in_words(branch, size(branch%point))
            do i = 1, size(branch%point)
               associate (point => branch%point(i))
                  if (.not. any(point%mark == [mark_fold, mark_doubling, mark_torus, mark_grazing, mark_lost])) cycle
                  write (unit, '(4x, a)') mark_words(point%mark)//' '//value_of(point)//'   ' &
                     //crossing_in_words(point)
               end associate
            end do
         end associate
      end do

   contains

      !> Value of the parameter at a point, with its unit.
      function value_of(point) result(words)
         type(orbit_point_t), intent(in) :: point
         character(:), allocatable :: words

         words = value_in_units(units, trim(self%study%quantity), point%value, decimals)
      end function value_of
   end subroutine print_orbits

   !> Reason why a branch ends at one of its ends, as a text that follows "begins where" or "ends where".
   pure function end_in_words(branch, place) result(words)
      type(orbit_branch_t), intent(in) :: branch
      !> Index of its first or last point
      integer, intent(in) :: place
      character(:), allocatable :: words

      integer :: start

      associate (point => branch%point)
         if (place == 1 .and. branch%parent > 0) then
            words = 'it leaves its parent at a period doubling'
            return
         end if
         select case (point(place)%mark)
         case (mark_limit)
            words = 'the range ends'
         case (mark_grazing)
            words = 'an impact appears or vanishes (grazing)'
         case (mark_doubling)
            words = 'it meets a branch of half its period at a period doubling'
         case (mark_lost)
            words = "Newton's method finds no motion farther on"
         case default
            words = 'most_points are used up'
            ! the first point of a branch that leaves another is that of the period doubling
            start = merge(2, 1, branch%parent > 0)
            if (size(point) > start .and. abs(point(start)%value - point(size(point))%value) <= 0.0_wp) then
               words = 'it closes in itself'
            end if
         end select
      end associate
   end function end_in_words

   !> The multiplier that crosses the unit circle at a bifurcation; at other points the largest.
   pure function crossing_in_words(point) result(words)
      type(orbit_point_t), intent(in) :: point
      character(:), allocatable :: words

      associate (multiplier => point%multiplier)
         select case (point%mark)
         case (mark_fold)
            words = 'multiplier '//multiplier_in_words(multiplier(minloc(abs(multiplier - (1.0_wp, 0.0_wp)), dim=1)))
         case (mark_doubling)
            words = 'multiplier '//multiplier_in_words(multiplier(minloc(abs(multiplier + (1.0_wp, 0.0_wp)), dim=1)))
         case (mark_torus)
            words = 'multiplier '//multiplier_in_words(multiplier(max(1, minloc(abs(abs(multiplier) - 1.0_wp), dim=1, &
               mask=abs(aimag(multiplier)) > 0.0_wp))))
         case default
            words = 'largest multiplier '//multiplier_in_words(multiplier(1))
         end select
      end associate
   end function crossing_in_words

   !> A complex multiplier, or a conjugate pair, as text.
   pure function multiplier_in_words(multiplier) result(words)
      complex(wp), intent(in) :: multiplier
      character(:), allocatable :: words

      words = with_decimals(real(multiplier, wp), decimals)
      if (abs(aimag(multiplier)) > 0.0_wp) words = words//' +- '//with_decimals(abs(aimag(multiplier)), decimals)//' i'
   end function multiplier_in_words

   !> Number and noun, in the plural unless the number is 1: '1 impact', '2 impacts'.
   pure function counted(number, noun) result(words)
      integer, intent(in) :: number
      !> Noun in the singular
      character(*), intent(in) :: noun
      character(:), allocatable :: words

      words = to_text(number)//' '//noun
      if (number /= 1) words = words//'s'
   end function counted

end module orbit_analysis
